// Renders random scenes, and feeds random bits, through the C ABI for a while: nothing may crash, hang or become infinite.
//
//   sppm_fuzz [--seconds N] [--seed S] [--cases N]
//
// Every case has its own seed, which is told when it fails: `--seed S --cases 1` repeats it.
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "fuzz_scene.h"

// Exists only where the program is built with a sanitizer.
extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));

namespace {

constexpr unsigned kSecondsForACase = 60;  // sanitized on a busy machine; a second is much otherwise

char repeat[100];  // how to repeat the case under way

void tell_how_to_repeat() {
  if (write(STDERR_FILENO, repeat, std::strlen(repeat)) < 0) _exit(3);
}

void die(int number) {
  tell_how_to_repeat();
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void watch_for_death() {
  for (const int number : {SIGABRT, SIGFPE, SIGILL, SIGALRM}) std::signal(number, die);
  if (__sanitizer_set_death_callback)
    __sanitizer_set_death_callback(tell_how_to_repeat);
  else
    for (const int number : {SIGSEGV, SIGBUS}) std::signal(number, die);
}

bool may_be_negative(uint32_t pass) {
  return pass == SPPM_PASS_NORMAL || pass == SPPM_PASS_DEPTH || pass == SPPM_PASS_POSITION || pass == SPPM_PASS_UV ||
         pass == SPPM_PASS_DENOISING_NORMAL;
}

// "" if every value of every pass is finite and no light negative.
std::string check_passes(const SppmSession* session, uint64_t pixels) {
  for (uint32_t pass = 0; pass < SPPM_PASS_COUNT; ++pass) {
    uint32_t channels = 0;
    if (sppm_pass_channels(pass, &channels) != SPPM_OK) return sppm_last_message();
    std::vector<float> values(pixels * channels);
    if (sppm_session_read_pass(session, pass, values.data(), values.size()) != SPPM_OK) return sppm_last_message();
    for (size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i]) || (values[i] < 0 && !may_be_negative(pass)))
        return "pass " + std::to_string(pass) + " is " + std::to_string(values[i]) + " at " + std::to_string(i);
  }
  return "";
}

// "" if a step does what it should; scrambled or not, a scene that was accepted renders.
std::string check_step(SppmSession* session) {
  return sppm_session_step(session) == SPPM_OK ? "" : std::string("a step: ") + sppm_last_message();
}

std::string check_cancel(SppmSession* session) {
  if (sppm_session_cancel(session) != SPPM_OK) return sppm_last_message();
  return sppm_session_step(session) == SPPM_CANCELLED ? "" : "a cancelled step was not";
}

struct Tally {
  uint64_t rendered = 0, dropped = 0;
};

// Builds and renders one scene; tells what is wrong.
std::string run_case(uint64_t seed, Tally& tally) {
  Chance chance(seed);
  FuzzScene scene(chance, chance.one_in(2));
  if (!scene.committed() || !scene.problem().empty()) return scene.problem();
  SppmSession* session = nullptr;
  const SppmSettings settings = scene.settings();
  if (!scene.accept(sppm_session_create(scene.handle(), &settings, &session))) return scene.problem();
  std::string problem;
  for (uint32_t n = 1 + chance.below(3); n > 0 && problem.empty(); --n) {
    problem = check_step(session);
    if (chance.one_in(3)) scene.move();
  }
  if (problem.empty() && chance.one_in(4)) problem = check_cancel(session);
  if (problem.empty()) problem = scene.problem();
  if (problem.empty()) problem = check_passes(session, scene.pixels());
  SppmProgress progress{};
  progress.struct_size = sizeof progress;
  if (sppm_session_progress(session, &progress) != SPPM_OK) problem = sppm_last_message();
  ++tally.rendered, tally.dropped += progress.dropped_samples;
  sppm_session_destroy(session);
  return problem;
}

// The number after `name` on the command line, or `otherwise`.
uint64_t option(int argc, char** argv, const std::string& name, uint64_t otherwise) {
  for (int i = 1; i + 1 < argc; i += 2)
    if (argv[i] == name) return std::strtoull(argv[i + 1], nullptr, 10);
  return otherwise;
}

}  // namespace

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  const uint64_t most = option(argc, argv, "--cases", ~uint64_t{0});
  const auto end = Clock::now() + std::chrono::seconds(option(argc, argv, "--seconds", 5));
  uint64_t seed = option(argc, argv, "--seed", std::random_device{}());
  std::printf("fuzz: from seed %llu\n", static_cast<unsigned long long>(seed));
  watch_for_death();
  Tally tally;
  uint64_t cases = 0, failed = 0;
  for (; cases < most && Clock::now() < end; ++cases, seed = std::mt19937_64(seed)()) {
    std::snprintf(repeat, sizeof repeat, "fuzz: died; repeat with --seed %llu --cases 1\n", static_cast<unsigned long long>(seed));
    alarm(kSecondsForACase);
    const std::string problem = run_case(seed, tally);
    if (problem.empty()) continue;
    ++failed;
    std::printf("fuzz: %s; repeat with --seed %llu --cases 1\n", problem.c_str(), static_cast<unsigned long long>(seed));
  }
  std::printf("fuzz: %llu cases, %llu rendered, %llu samples dropped, %llu failed\n", static_cast<unsigned long long>(cases),
              static_cast<unsigned long long>(tally.rendered), static_cast<unsigned long long>(tally.dropped),
              static_cast<unsigned long long>(failed));
  return failed == 0 && tally.rendered > 0 ? 0 : 1;
}
