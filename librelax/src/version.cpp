#include "relax/version.hpp"

#include "weave/version.hpp"

namespace relax {

const char* version() {
  return weave::version();
}

}  // namespace relax
