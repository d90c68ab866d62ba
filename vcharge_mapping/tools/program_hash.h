#pragma once

#include <string>

namespace vcharge {

/// Of this program's file and the suite's libraries that it has loaded: another build of the code has another
/// one.
std::string programHash();

}  // namespace vcharge
