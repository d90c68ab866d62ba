#include "intrinsics/calibration_verdict.h"

#include <algorithm>
#include <cmath>

#include "vcharge_calibration/intrinsics/image_coverage.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {

namespace {

constexpr double kWarnCoverage = 0.6;
constexpr double kFailCoverage = 0.35;
// Boards within this radius, relative to half the longer image side, are all in the middle.
constexpr double kFailReach = 0.7;
constexpr double kWarnError_px = 0.5;
constexpr double kFailError_px = 3.0;
constexpr double kWarnUnseen = 1.5;
// Minimum tilt of views against the line of sight; without tilt, focal length and distance correlate.
constexpr double kMinTilt_rad = 0.25;
constexpr double kMinTiltedFraction = 0.2;

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  }
  return text;
}

double tilt(const PosedBoard& posed) {
  const Eigen::Vector3d normal = posed.camera_from_board.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d to_board = posed.camera_from_board.translation().normalized();
  return std::acos(std::min(1.0, std::abs(normal.dot(to_board))));
}

}  // namespace

void judgeCalibration(const IntrinsicCalibrationOptions& options, IntrinsicCalibration* result) {
  ImageCoverage coverage(result->image_size_px);
  size_t tilted = 0;
  for (const CalibratedView& view : result->views) {
    coverage.add(view.view);
    tilted += tilt(view.posed) > kMinTilt_rad ? 1 : 0;
  }
  result->remarks.clear();
  const auto fail = [result](const std::string& reason) {
    result->verdict = Verdict::kFail;
    result->model.reset();
    result->remarks = {reason};
  };
  if (!(result->rms_px <= kFailError_px)) {
    return fail("no camera of the model " + options.model +
                " explains the corners: " + toText(result->rms_px, 1) + " px RMS");
  }
  if (coverage.coveredFraction() < kFailCoverage || coverage.reach() < kFailReach) {
    return fail("the board was only seen in the middle, on " + toText(100.0 * coverage.coveredFraction(), 0) +
                " % of the image: pictures with the board in the " + join(coverage.missingParts()) +
                " part of the image are missing");
  }
  result->verdict = Verdict::kPass;
  const auto warn = [result](const std::string& remark) {
    result->verdict = Verdict::kWarn;
    result->remarks.push_back(remark);
  };
  const std::vector<std::string> missing = coverage.missingParts();
  if (coverage.coveredFraction() < kWarnCoverage || !missing.empty()) {
    warn("corners cover only " + toText(100.0 * coverage.coveredFraction(), 0) + " % of the image: " +
         (missing.empty()
              ? "hold the board also at its sides and in its corners"
              : "pictures with the board in the " + join(missing) + " part of the image are missing"));
  }
  if (static_cast<double>(tilted) < kMinTiltedFraction * static_cast<double>(result->views.size())) {
    warn("the board faces the camera in nearly all images: pictures with the board tilted are missing");
  }
  if (result->rms_px > kWarnError_px) {
    warn("the error of " + toText(result->rms_px, 2) +
         " px RMS is large: is the board flat, its size right?");
  }
  if (result->cross_validated_px > kWarnUnseen * result->rms_px) {
    warn("views that the fit did not see are off by " + toText(result->cross_validated_px, 2) +
         " px, much more than the others: more views are needed");
  }
  if (!result->standard_deviations.allFinite()) {
    warn("the views do not determine all parameters: tilt the board, and hold it near and far");
  }
}

}  // namespace vcharge
