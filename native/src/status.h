// The one exception of the library: a status for the C border and a message for the user.
#pragma once

#include <concepts>
#include <stdexcept>
#include <string>

#include "sppm/sppm.h"

namespace sppm {

class Error : public std::runtime_error {
 public:
  Error(SppmStatus status, const std::string& message) : std::runtime_error(message), status_(status) {}
  SppmStatus status() const { return status_; }

 private:
  SppmStatus status_;
};

inline void require(bool condition, const std::string& message) {
  if (!condition) throw Error(SPPM_INVALID_ARGUMENT, message);
}
// For checks of millions: the message is made only where it is needed.
template <std::invocable Message>
void require(bool condition, const Message& message) {
  if (!condition) throw Error(SPPM_INVALID_ARGUMENT, message());
}

}  // namespace sppm
