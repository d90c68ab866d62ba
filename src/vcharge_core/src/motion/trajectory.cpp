#include "vcharge_core/motion/trajectory.h"

#include <cmath>
#include <cstdio>
#include <sstream>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

Trajectory readTrajectory(const std::string& path) {
  std::istringstream text(readTextFile(path));
  Trajectory trajectory;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    const std::string where = path + ": line " + std::to_string(number);
    std::istringstream fields(line.substr(0, line.find('#')));
    std::string time;
    if (!(fields >> time)) {
      continue;
    }
    double v[7];
    for (double& value : v) {
      if (!(fields >> value) || !std::isfinite(value)) {
        throw InputError(where + ": expected 'time_s tx ty tz qx qy qz qw'");
      }
    }
    std::string rest;
    if (fields >> rest) {
      throw InputError(where + ": expected eight numbers, found '" + rest + "' after them");
    }
    const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    if (std::abs(rotation.norm() - 1.0) > 1e-3) {
      throw InputError(where + ": qx qy qz qw: expected a unit quaternion, its norm is " +
                       std::to_string(rotation.norm()));
    }
    Timestamp stamp;
    try {
      stamp = timestampFromString(time);
    } catch (const InputError& error) {
      throw InputError(where + ": " + error.what());
    }
    if (!trajectory.empty() && stamp <= trajectory.back().stamp) {
      throw InputError(where + ": time_s: expected increasing stamps, " + toString(stamp) + " follows " +
                       toString(trajectory.back().stamp));
    }
    trajectory.push_back({stamp, RigidTransform(rotation, Eigen::Vector3d(v[0], v[1], v[2]))});
  }
  if (trajectory.empty()) {
    throw InputError(path + ": expected lines 'time_s tx ty tz qx qy qz qw', got none");
  }
  return trajectory;
}

void writeTrajectory(const Trajectory& trajectory, const std::string& path) {
  std::string text = "# time_s tx ty tz qx qy qz qw (world_from_vehicle, metres)\n";
  for (const StampedTransform& entry : trajectory) {
    const Eigen::Vector3d& t = entry.world_from_vehicle.translation();
    const Eigen::Quaterniond& q = entry.world_from_vehicle.rotation();
    char line[320];
    std::snprintf(line, sizeof(line), "%s %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n",
                  toString(entry.stamp).c_str(), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    text += line;
  }
  writeTextFileAtomically(path, text);
}

}  // namespace vcharge
