#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vcharge {

/// How much each camera sees, relative to what it usually sees and to what the other cameras see at the
/// time: 1 as usual, 0 nothing.
class CameraSight {
 public:
  explicit CameraSight(size_t num_cameras) : usual_(num_cameras) {}

  /// Adds the observations of landmarks in the next part of a drive.
  std::vector<double> add(const std::vector<int64_t>& num_observations, double length_m);

 private:
  std::vector<std::vector<double>> usual_;  ///< observations per metre of the last parts, by camera
};

}  // namespace vcharge
