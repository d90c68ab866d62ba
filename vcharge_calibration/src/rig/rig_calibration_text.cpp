#include "vcharge_calibration/rig/rig_calibration_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;

/// A line with a name and numbers in columns.
std::string tableRow(const std::string& name, const Eigen::Matrix<double, 6, 1>& values) {
  char text[128];
  std::snprintf(text, sizeof(text), "%-10s %9.2f %9.2f %9.2f   %9.3f %9.3f %9.3f", name.c_str(), values[0],
                values[1], values[2], values[3], values[4], values[5]);
  return text;
}

std::string describeCamera(const CameraCalibration& camera, const RigidTransform& vehicle_from_camera) {
  char counts[64];
  std::snprintf(counts, sizeof(counts), "   %8lld %8lld", static_cast<long long>(camera.num_observations),
                static_cast<long long>(camera.num_common_landmarks));
  std::string text = tableRow(camera.name, positionAndAngles(vehicle_from_camera)) + counts + "\n" +
                     tableRow("  +-", positionAndAngleSigmas(camera.covariance)) +
                     "   about z, y, x of the vehicle\n";
  if (!camera.weakest_direction.empty()) {
    text += "  least certain: " + camera.weakest_direction + "\n";
  }
  return text;
}

std::string describeDirection(const std::string& camera, const char* name, const Eigen::Vector3d& in_camera) {
  if (in_camera.norm() == 0.0) {
    return "";
  }
  return "camera '" + camera + "': " + name + " is (" + toText(in_camera.x(), 4) + ", " +
         toText(in_camera.y(), 4) + ", " + toText(in_camera.z(), 4) + ") in its frame\n";
}

/// Known directions of cameras without extrinsics.
std::string describeDirections(const RigCalibration& result) {
  std::string text;
  for (const CameraCalibration& camera : result.cameras) {
    text += describeDirection(camera.name, "straight ahead", camera.initial.travel_in_camera) +
            describeDirection(camera.name, "upwards", camera.up_in_camera);
  }
  return text;
}

}  // namespace

Eigen::Matrix<double, 6, 1> positionAndAngles(const RigidTransform& vehicle_from_camera) {
  Eigen::Matrix3d optical_from_body;
  optical_from_body << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
  const Eigen::Matrix3d body = vehicle_from_camera.rotationMatrix() * optical_from_body;
  Eigen::Matrix<double, 6, 1> result;
  result << 100.0 * vehicle_from_camera.translation(), kDegrees * std::atan2(body(1, 0), body(0, 0)),
      kDegrees * std::asin(std::clamp(-body(2, 0), -1.0, 1.0)), kDegrees * std::atan2(body(2, 1), body(2, 2));
  return result;
}

Eigen::Matrix<double, 6, 1> positionAndAngleSigmas(const Eigen::Matrix<double, 6, 6>& covariance) {
  const Eigen::Matrix<double, 6, 1> sigmas = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  Eigen::Matrix<double, 6, 1> result;
  result << 100.0 * sigmas.head<3>(), kDegrees * sigmas[5], kDegrees * sigmas[4], kDegrees * sigmas[3];
  return result;
}

std::string describeIntrinsics(const IntrinsicsDeviation& found) {
  constexpr double kShownRatio = 0.5;
  const auto value = [&](const char* name, int axis, double unit, const char* unit_name, int digits) {
    const double sigma = found.sigmas[axis], prior_sigma = found.prior_sigmas[axis];
    return name + toText(unit * found.deviation[axis], digits) + " +- " + toText(unit * sigma, digits) +
           unit_name + (sigma < kShownRatio * prior_sigma ? "" : " (hardly seen in this drive)");
  };
  return value("focal length ", 0, 100.0, " %", 3) + value(", principal point ", 1, 1.0, " px", 2) +
         value(", ", 2, 1.0, " px", 2);
}

std::string describeTiming(const TimingEstimate& timing) {
  constexpr double kShown_s = 0.00005;
  const auto readout = [](const ImageTiming& each) {
    const char* const names[] = {"top to bottom", "bottom to top", "left to right", "right to left"};
    const ImageTiming normalized = each.normalized();
    return "lines from " + std::string(names[static_cast<size_t>(normalized.readout_direction)]) +
           " within " + toText(1000.0 * normalized.readout_s, 1) + " ms";
  };
  const auto offset = [](const ImageTiming& each) {
    return "clock offset " + toText(1000.0 * each.clock_offset_s, 1) + " ms";
  };
  const bool knows_readout = timing.known.readout_s > kShown_s;
  const bool knows_offset = std::abs(timing.known.clock_offset_s) > kShown_s;
  std::string known = knows_readout ? readout(timing.known) : "";
  known += knows_offset ? (knows_readout ? ", " : "") + offset(timing.known) : "";
  return readout(timing.found) + " +- " + toText(1000.0 * timing.sigmas[0], 2) + " ms, " +
         offset(timing.found) + " +- " + toText(1000.0 * timing.sigmas[1], 2) + " ms; the rig said " +
         (known.empty() ? "all at the stamp" : known);
}

std::string describeCalibration(const RigCalibration& result) {
  std::string text = toText(result.distance_m, 0) + " m, " + toText(kDegrees * result.left_turn_rad, 0) +
                     " degrees of turn to the left, " + toText(kDegrees * result.right_turn_rad, 0) +
                     " to the right; " + std::to_string(result.num_keyframes) + " keyframes, " +
                     std::to_string(result.num_landmarks) + " landmarks, " +
                     (result.is_from_map ? ""
                                         : std::to_string(result.num_loop_edges) + " loop edges, " +
                                               std::to_string(result.num_inter_camera_matches) +
                                               " matches in rectified views, " +
                                               std::to_string(result.num_aligned_observations) +
                                               " observations aligned with their landmark's patch, ") +
                     "error " + toText(result.rms_px, 3) + " px RMS per coordinate\n";
  if (result.rig == nullptr) {
    return text + describeDirections(result);
  }
  char heading[128];
  std::snprintf(heading, sizeof(heading), "%-10s %9s %9s %9s   %9s %9s %9s   %8s %8s\n", "camera", "x (cm)",
                "y (cm)", "z (cm)", "yaw (deg)", "pitch", "roll", "points", "shared");
  text += heading;
  for (size_t i = 0; i < result.cameras.size(); ++i) {
    text += describeCamera(result.cameras[i], *result.rig->cameras[i].vehicle_from_camera);
  }
  for (const CameraCalibration& camera : result.cameras) {
    if (camera.intrinsics && camera.intrinsics->is_corrected) {
      text += "camera '" + camera.name + "': corrected by " + describeIntrinsics(*camera.intrinsics) + "\n";
    }
    if (camera.timing && camera.timing->is_corrected) {
      text += "camera '" + camera.name + "': " + describeTiming(*camera.timing) + "\n";
    }
  }
  return text + "height: " + result.height_source + "\nscale, common to all positions: +- " +
         toText(100.0 * result.rig->scale_sigma, 2) + " %\n";
}

}  // namespace vcharge
