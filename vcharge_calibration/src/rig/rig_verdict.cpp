#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/rig_judgement.h"
#include "vcharge_calibration/rig/rig_calibration_text.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
// Standard deviations: below the first a calibration is good, above the second it is useless.
constexpr double kGoodSigma_m = 0.01, kBadSigma_m = 0.05;
constexpr double kGoodSigma_rad = 0.1 / kDegrees, kBadSigma_rad = 0.5 / kDegrees;
// Largest differences between the halves of the drive.
constexpr double kMaxHalfSigmas = 4.0;
constexpr double kBadHalf_m = 0.10, kBadHalf_rad = 0.5 / kDegrees;
// Ratio of reprojection error that neighbouring pixels have in common; large for wrong intrinsics.
constexpr double kWarnStructure = 0.4, kFailStructure = 0.7;
// A camera's inlier ratio divided by the median of the other cameras.
constexpr double kWarnFit = 0.75, kFailFit = 0.65;
// Deviations of an image that matter: over those by heat, and over their standard deviations.
constexpr double kMaxImageRatio = 0.25, kMaxImageSigmas = 4.0;
constexpr double kMinTurn_rad = 90.0 / kDegrees;
constexpr double kMinDistance_m = 50.0;
constexpr double kWarnOffset_s = 0.01, kFailOffset_s = 0.3;
constexpr int64_t kMinCommonLandmarks = 20;
// Smaller deviations hardly move the extrinsics. Sigmas are large where the timing is wrong: the observations
// then contradict each other.
constexpr double kMaxReadoutDeviation_s = 0.004, kMaxClockDeviation_s = 0.002, kMaxTimingSigmas = 3.0;

class RigJudge {
 public:
  explicit RigJudge(RigCalibration* result) : result_(result) {}

  void judge() {
    judgeSigmas();
    for (const CameraCalibration& camera : result_->cameras) {
      judgeHalves(camera);
      judgeErrors(camera);
      judgeIntrinsics(camera);
      judgeTiming(camera);
    }
    judgeFit();
    judgeDrive();
    std::stable_sort(found_.begin(), found_.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    result_->verdict = found_.empty() ? Verdict::kPass : found_.front().first;
    for (auto& [grade, remark] : found_) {
      result_->remarks.push_back(remark);
    }
  }

 private:
  void remark(Verdict grade, const std::string& text) { found_.emplace_back(grade, text); }

  /// Adds one remark per degree of freedom, with all cameras for which it is too uncertain.
  void judgeSigmas() {
    const char* const names[] = {"forwards", "sideways", "height", "roll", "pitch", "yaw"};
    for (const CameraCalibration& camera : result_->cameras) {
      if (!(camera.covariance.diagonal().minCoeff() > 0.0)) {
        remark(Verdict::kFail,
               "camera '" + camera.name + "': its extrinsics are not observable in this drive");
        return;
      }
    }
    for (int i = 0; i < 6; ++i) {
      double worst = 0.0;
      std::string who;
      for (const CameraCalibration& camera : result_->cameras) {
        const double sigma = std::sqrt(camera.covariance(i, i));
        if (sigma > (i < 3 ? kGoodSigma_m : kGoodSigma_rad)) {
          who += (who.empty() ? "'" : ", '") + camera.name + "'";
          worst = std::max(worst, sigma);
        }
      }
      if (!who.empty()) {
        remark(worst > (i < 3 ? kBadSigma_m : kBadSigma_rad) ? Verdict::kFail : Verdict::kWarn,
               who + ": " + names[i] + " is known only to " + amount(i, worst) + ": " +
                   (i == 2 ? "too little ground, or too few landmarks shared with other cameras"
                           : "drive further, with tighter turns to both sides"));
      }
    }
  }

  void judgeHalves(const CameraCalibration& camera) {
    for (int i = 0; i < 6; ++i) {
      const double difference = std::abs(camera.half_difference[i]);
      const double limit = i < 3 ? kGoodSigma_m : kGoodSigma_rad;
      // Each half has twice the variance of the whole drive.
      const double sigmas = difference / (2.0 * std::sqrt(std::max(1e-18, camera.covariance(i, i))));
      if (difference > (i < 3 ? kBadHalf_m : kBadHalf_rad)) {
        remark(Verdict::kFail,
               "camera '" + camera.name + "': two halves of the drive differ by " + amount(i, difference));
        return;
      }
      if (difference > limit && sigmas > kMaxHalfSigmas) {
        remark(Verdict::kWarn, "camera '" + camera.name + "': two halves of the drive differ by " +
                                   amount(i, difference) + ", " + toText(sigmas, 1) + " standard deviations");
        return;
      }
    }
  }

  static std::string amount(int i, double value) {
    return i < 3 ? toText(100.0 * value, 1) + " cm" : toText(kDegrees * value, 2) + " degrees";
  }

  void judgeErrors(const CameraCalibration& camera) {
    const double ratio = camera.rms_px > 0.0 ? camera.structure_px / camera.rms_px : 0.0;
    if (ratio > kWarnStructure) {
      remark(ratio > kFailStructure ? Verdict::kFail : Verdict::kWarn,
             "camera '" + camera.name + "': errors correlate over the image (" + toText(100.0 * ratio, 0) +
                 " % of them): wrong intrinsics. Calibrate the intrinsics again");
    }
    // A map connects the cameras even without common landmarks.
    if (camera.num_common_landmarks < kMinCommonLandmarks && result_->cameras.size() > 1 &&
        !result_->is_from_map) {
      remark(Verdict::kWarn, "camera '" + camera.name + "' shares only " +
                                 std::to_string(camera.num_common_landmarks) +
                                 " landmarks with other cameras: revisit places in both directions");
    }
  }

  /// Extrinsics make up for wrong intrinsics, with small reprojection errors.
  void judgeIntrinsics(const CameraCalibration& camera) {
    if (!camera.intrinsics || camera.intrinsics->is_corrected) {
      return;
    }
    const IntrinsicsDeviation& found = *camera.intrinsics;
    const Eigen::Array3d size = found.deviation.array().abs();
    if ((size > kMaxImageRatio * found.prior_sigmas.array() && size > kMaxImageSigmas * found.sigmas.array())
            .any()) {
      remark(Verdict::kWarn, "camera '" + camera.name +
                                 "': its image deviates from its intrinsics: " + describeIntrinsics(found) +
                                 ". Calibrate the intrinsics again, or correct them by this drive with "
                                 "adjustment.refine_intrinsics");
    }
  }

  /// Likewise for lines that are exposed at other times than the rig says.
  void judgeTiming(const CameraCalibration& camera) {
    if (!camera.timing || camera.timing->is_corrected) {
      return;
    }
    const Eigen::Array2d size = camera.timing->deviation().array().abs();
    const Eigen::Array2d limit(kMaxReadoutDeviation_s, kMaxClockDeviation_s);
    if ((size > limit && size > kMaxTimingSigmas * camera.timing->sigmas.array()).any()) {
      remark(Verdict::kWarn, "camera '" + camera.name + "': its images look as if exposed in " +
                                 describeTiming(*camera.timing) +
                                 ". Give the rig readout_s and clock_offset_s, or find them by this drive "
                                 "with adjustment.refine_timing");
    }
  }

  /// With wrong intrinsics few observations fit; the error of these is small because the others were removed.
  void judgeFit() {
    const auto fittingRatio = [](const CameraCalibration& camera) {
      return static_cast<double>(camera.num_observations) /
             std::max(1.0, static_cast<double>(camera.num_tracked));
    };
    for (const CameraCalibration& camera : result_->cameras) {
      std::vector<double> others;
      for (const CameraCalibration& other : result_->cameras) {
        if (&other != &camera) {
          others.push_back(fittingRatio(other));
        }
      }
      if (others.size() < 2) {
        return;  // two cameras may differ because of what they see
      }
      std::sort(others.begin(), others.end());
      const double usual = others[others.size() / 2];
      const double ratio = fittingRatio(camera);
      if (ratio < kWarnFit * usual) {
        remark(ratio < kFailFit * usual ? Verdict::kFail : Verdict::kWarn,
               "camera '" + camera.name + "': only " + toText(100.0 * ratio / usual, 0) +
                   " % as many observations fit as of the other cameras: wrong intrinsics, or it moved "
                   "during the drive");
      }
    }
  }

  void judgeDrive() {
    const RigCalibration& drive = *result_;
    for (const auto& [turn_rad, side] :
         {std::make_pair(drive.left_turn_rad, "left"), std::make_pair(drive.right_turn_rad, "right")}) {
      if (turn_rad < kMinTurn_rad) {
        remark(Verdict::kWarn, std::string("the drive turned only ") + toText(kDegrees * turn_rad, 0) +
                                   " degrees to the " + side +
                                   ": turn to both sides, best a figure of eight");
      }
    }
    if (drive.distance_m < kMinDistance_m && !drive.is_from_map) {
      remark(Verdict::kWarn,
             "the drive is only " + toText(drive.distance_m, 0) + " m long: drive 100 m or more");
    }
    if (drive.num_loop_edges == 0 && !drive.is_from_map) {
      remark(Verdict::kWarn, "no loop was closed: return to the start of the drive");
    }
    if (std::abs(drive.time_offset_s) > kWarnOffset_s) {
      remark(std::abs(drive.time_offset_s) > kFailOffset_s ? Verdict::kFail : Verdict::kWarn,
             "the odometer's stamps are " + toText(1000.0 * std::abs(drive.time_offset_s), 0) + " ms " +
                 (drive.time_offset_s > 0.0 ? "late" : "early") +
                 " against the images. They are corrected here, but other stages use the stamps as they are: "
                 "correct the clocks");
    }
  }

  RigCalibration* const result_;
  std::vector<std::pair<Verdict, std::string>> found_;
};

}  // namespace

void findVerdict(RigCalibration* result) {
  RigJudge(result).judge();
}

}  // namespace vcharge
