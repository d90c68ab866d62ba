#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vcharge {

/// How much each camera sees, relative to what it usually sees and to what the other cameras see at the
/// time: 1 as usual, 0 nothing. A camera in the dark is taken to see as usual: that is not its lens.
class CameraSight {
 public:
  explicit CameraSight(size_t num_cameras) : usual_(num_cameras) {}

  /// What a camera saw in a part of a drive.
  struct Seen {
    int64_t num_observations = 0;  ///< of landmarks
    double level = 0.0;            ///< mean of its pixels
  };
  std::vector<double> add(const std::vector<Seen>& seen, double length_m);

 private:
  struct Usual {
    std::vector<double> per_metre, levels;  ///< in the last parts
  };
  std::vector<Usual> usual_;
};

}  // namespace vcharge
