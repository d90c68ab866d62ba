#include <algorithm>
#include <cmath>

#include "vcharge_core/base/text_format.h"
#include "vcharge_mapping/map_report.h"

namespace vcharge {
namespace {

// Numbers of landmarks observed at a keyframe; localization needs 20 matches.
constexpr int kFewLandmarks = 60;
constexpr int kTooFewLandmarks = 20;
constexpr double kMaxRatioWithFew = 0.05;
// Reprojection errors per coordinate. Good tracks have about half a pixel in images of any size.
constexpr double kHighError_px = 1.2;
constexpr double kTooHighError_px = 3.0;
// Ratios of all frames.
constexpr double kManySkipped = 0.05;
constexpr double kTooManySkipped = 0.3;
constexpr double kManyByOdometry = 0.1;
constexpr double kTooManyByOdometry = 0.5;
constexpr double kManySlips = 0.1;
// Deviations of the odometer's factors from 1: larger than for a calibrated odometer, and for any odometer.
constexpr double kOddFactor = 0.03;
constexpr double kWrongFactor = 0.1;
/// Ratio of contradicting to accepted loop edges.
constexpr double kManyContradictions = 0.1;

class Judge {
 public:
  explicit Judge(MapVerdict* verdict) : verdict_(verdict) {}

  /// Adds a remark if a value exceeds the first or second bound.
  void atMost(double value, double warn_above, double fail_above, const std::string& remark) {
    if (value > warn_above) {
      add(value > fail_above ? MapGrade::kBad : MapGrade::kCheck, remark);
    }
  }
  void check(bool is_suspicious, const std::string& remark) {
    if (is_suspicious) {
      add(MapGrade::kCheck, remark);
    }
  }

 private:
  void add(MapGrade grade, const std::string& remark) {
    verdict_->grade = std::max(verdict_->grade, grade);
    verdict_->remarks.push_back(remark);
  }
  MapVerdict* verdict_;
};

double ratioOf(int64_t part, int64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::string percent(double ratio) {
  return toText(100.0 * ratio, 1) + " %";
}

/// Ratio of the keyframes with fewer observations.
double ratioWithFewer(const SparseMap& map, int count) {
  int64_t num_fewer = 0;
  const size_t num_cameras = map.rig().cameras.size();
  for (size_t k = 0; k < map.keyframes().size(); ++k) {
    const size_t seen = map.observationsOf(k, num_cameras - 1).second - map.observationsOf(k, 0).first;
    num_fewer += static_cast<int>(seen) < count ? 1 : 0;
  }
  return ratioOf(num_fewer, static_cast<int64_t>(map.keyframes().size()));
}

}  // namespace

std::string toString(MapGrade grade) {
  return grade == MapGrade::kGood ? "GOOD" : grade == MapGrade::kCheck ? "CHECK" : "BAD";
}

MapVerdict judgeMap(const SparseMap& map, const ReconstructionState& state) {
  MapVerdict verdict;
  Judge judge(&verdict);
  const ReconstructionReport& report = state.report;

  const double few = ratioWithFewer(map, kFewLandmarks), too_few = ratioWithFewer(map, kTooFewLandmarks);
  if (too_few > kMaxRatioWithFew) {
    judge.atMost(1.0, 0.0, 0.0,
                 percent(too_few) + " of the keyframes see fewer than " + std::to_string(kTooFewLandmarks) +
                     " landmarks: localization will fail there");
  } else {
    judge.check(few > kMaxRatioWithFew, percent(few) + " of the keyframes see fewer than " +
                                            std::to_string(kFewLandmarks) + " landmarks");
  }

  judge.atMost(report.rms_px, kHighError_px, kTooHighError_px,
               "the reprojection error is " + toText(report.rms_px, 2) +
                   " px RMS: is the rig's calibration that of this drive?");

  int64_t num_accepted = 0, num_contradict = 0;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    num_accepted += edge.accepted ? 1 : 0;
    num_contradict += edge.reason.rfind("contradicts", 0) == 0 ? 1 : 0;
  }
  judge.check(num_accepted == 0, "no loop was found: the path drifts with its length");
  judge.check(num_accepted > 0 && ratioOf(num_contradict, num_accepted) > kManyContradictions,
              std::to_string(num_contradict) + " verified loop edges contradict the map or the " +
                  std::to_string(num_accepted) + " accepted ones: similar places?");

  int64_t num_motions = 0;
  for (const int64_t count : report.num_motions) {
    num_motions += count;
  }
  const auto ratio_of_motion = [&](MotionHypothesis motion) {
    return ratioOf(report.num_motions[static_cast<size_t>(motion)], num_motions);
  };
  judge.atMost(ratio_of_motion(MotionHypothesis::kOdometry), kManyByOdometry, kTooManyByOdometry,
               "the odometer alone gave the motion of " +
                   percent(ratio_of_motion(MotionHypothesis::kOdometry)) +
                   " of the frames: too dark, too little texture, or covered lenses?");
  judge.check(ratio_of_motion(MotionHypothesis::kPlanar) > kManySlips,
              percent(ratio_of_motion(MotionHypothesis::kPlanar)) +
                  " of the frames moved unlike rolling wheels: slip, or wrong extrinsics?");

  const double distance = state.data.odometry_distance_scale, turn = state.data.odometry_turn_scale;
  judge.atMost(std::abs(distance - 1.0), kOddFactor, kWrongFactor,
               "true distances are " + toText(distance, 4) + " of what the odometer counted");
  judge.atMost(std::abs(turn - 1.0), kOddFactor, kWrongFactor,
               "true turns are " + toText(turn, 4) + " of what the odometer counted");

  const double without = ratioOf(report.counters.frames_without_odometry, report.counters.frames);
  judge.atMost(without, kManySkipped, kTooManySkipped,
               percent(without) + " of the frames have no odometry and were not used");
  const double incomplete = ratioOf(report.counters.incomplete_frames, report.counters.frames);
  judge.atMost(incomplete, kManySkipped, 1.0, percent(incomplete) + " of the frames lack a camera");
  judge.check(report.counters.odometry_resets > 0,
              "the odometer was reset " + std::to_string(report.counters.odometry_resets) + " times");
  judge.check(report.counters.numLateImages() > 0,
              std::to_string(report.counters.numLateImages()) + " images arrived too late to be used");
  return verdict;
}

}  // namespace vcharge
