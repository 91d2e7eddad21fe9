// Builds one random scene through the C ABI: wild, but as long as nothing is scrambled valid.
#pragma once

#include <string>
#include <vector>

#include "fuzz_chance.h"
#include "sppm/sppm.h"

// Makes the calls and keeps count of what was refused. A refusal is right only if something was scrambled.
class FuzzScene {
 public:
  // With `scrambled`, about every third description has fields of random bits.
  FuzzScene(Chance& chance, bool scrambled);
  ~FuzzScene();
  FuzzScene(const FuzzScene&) = delete;
  FuzzScene& operator=(const FuzzScene&) = delete;

  SppmScene* handle() const { return scene_; }
  uint64_t pixels() const { return pixels_; }
  bool committed() const { return committed_; }
  const std::string& problem() const { return problem_; }  // "" if all went as it should
  SppmSettings settings();
  void move();  // what can be, of a committed scene
  // Notes a status that should not be; true if it is SPPM_OK.
  bool accept(SppmStatus status);

 private:
  bool scramble() { return scrambled_ && chance_.one_in(3); }
  float length() { return scale_ * chance_.magnitude(-3, 1); }
  void place(float (&point)[3]);
  void transform(float (&m)[12], bool rigid);
  std::vector<float> motion(bool rigid);  // up to three places, often none
  void color(float (&c)[3], float most);
  SppmParam param(float most);
  SppmClosureDesc closure();
  void add_image();
  void add_texture();
  void add_material();
  void add_mesh();
  void add_instance();
  void add_light();
  void set_world();
  void set_camera();
  void set_camera_motion(const SppmCameraDesc& camera);

  Chance& chance_;
  bool scrambled_;
  SppmScene* scene_ = nullptr;
  float scale_ = 1, center_[3] = {0, 0, 0};
  std::vector<uint32_t> movable_;
  uint32_t images_ = 0, textures_ = 0, materials_ = 0, meshes_ = 0;
  uint64_t pixels_ = 0;
  bool committed_ = false;
  std::string problem_;
};
