#include "rig_judgement.h"

#include <algorithm>
#include <cmath>

#include "rig_adjustment.h"

namespace vcharge {

std::string describeFailure(const std::string& camera, const HandEye& initial, const RigCalibration& drive) {
  const std::string who = "camera '" + camera + "'";
  const double least_turn_rad = std::min(drive.left_turn_rad, drive.right_turn_rad);
  switch (initial.status) {
    case HandEyeStatus::kTooFewMotions:
      return who + ": too few images in which points could be followed (" + std::to_string(initial.num_motions) +
             " motions of " + std::to_string(drive.num_keyframes) + "): is it covered, dirty, or without light?";
    case HandEyeStatus::kNoTurn:
      return who + ": no turn: the drive turned " + toText(57.29578 * (drive.left_turn_rad), 0) +
             " degrees to the left and " + toText(57.29578 * drive.right_turn_rad, 0) +
             " to the right. Drive a figure of eight, so that the cameras turn about the rear axle" +
             (least_turn_rad > 1.0 ? " (odometry tells of turns that the images do not show)" : "");
    case HandEyeStatus::kNoAgreement:
      return who + ": its motions contradict the odometer's (" + std::to_string(initial.num_inliers) + " of " +
             std::to_string(initial.num_motions) +
             " agree): check the intrinsics, the stamps, and the odometer's signs";
    case HandEyeStatus::kOk:
      break;
  }
  return who;
}

void judgeRig(const RigCalibratorOptions& options, const MappingState& state,
              const std::optional<GroundPlane>& ground, RigCalibration* result) {
  (void)options;
  (void)ground;
  result->rig = state.data.rig;
  result->rms_px = state.report.rms_px;
  result->verdict = Verdict::kPass;
}

}  // namespace vcharge
