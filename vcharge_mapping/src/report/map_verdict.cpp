#include <algorithm>
#include <cmath>

#include "vcharge_core/base/text_format.h"
#include "vcharge_mapping/map_report.h"

namespace vcharge {
namespace {

// Landmarks that the rig sees at a keyframe: localization drops frames with fewer than 20 matches.
constexpr int kFewLandmarks = 60;
constexpr int kTooFewLandmarks = 20;
constexpr double kMaxShareWithFew = 0.05;
// Errors of reprojection per coordinate. Good tracks are about half a pixel off in images of any size.
constexpr double kHighError_px = 1.2;
constexpr double kTooHighError_px = 3.0;
// Shares of the frames.
constexpr double kManySkipped = 0.05;
constexpr double kTooManySkipped = 0.3;
constexpr double kManyByOdometry = 0.1;
constexpr double kTooManyByOdometry = 0.5;
constexpr double kManySlips = 0.1;
/// Of the odometer's factors from 1: outside a calibrated odometer's, and outside any.
constexpr double kOddFactor = 0.03;
constexpr double kWrongFactor = 0.1;
/// Of edges that the pose graph rejected to those it accepted.
constexpr double kManyContradictions = 0.1;

class Judge {
 public:
  explicit Judge(MapVerdict* verdict) : verdict_(verdict) {}

  /// Remarks on a number that should be small.
  void atMost(double value, double odd, double bad, const std::string& remark) {
    if (value > odd) {
      add(value > bad ? MapGrade::kBad : MapGrade::kCheck, remark);
    }
  }
  void check(bool is_odd, const std::string& remark) {
    if (is_odd) {
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

double shareOf(int64_t part, int64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::string percent(double share) {
  return toText(100.0 * share, 1) + " %";
}

/// Share of the keyframes that see fewer landmarks.
double shareWithFewer(const SparseMap& map, int count) {
  int64_t num_fewer = 0;
  const size_t num_cameras = map.rig().cameras.size();
  for (size_t k = 0; k < map.keyframes().size(); ++k) {
    const size_t seen = map.observationsOf(k, num_cameras - 1).second - map.observationsOf(k, 0).first;
    num_fewer += static_cast<int>(seen) < count ? 1 : 0;
  }
  return shareOf(num_fewer, static_cast<int64_t>(map.keyframes().size()));
}

}  // namespace

std::string toString(MapGrade grade) {
  return grade == MapGrade::kGood ? "GOOD" : grade == MapGrade::kCheck ? "CHECK" : "BAD";
}

MapVerdict judgeMap(const SparseMap& map, const MappingState& state) {
  MapVerdict verdict;
  Judge judge(&verdict);
  const SparseMapperReport& report = state.report;

  const double few = shareWithFewer(map, kFewLandmarks), too_few = shareWithFewer(map, kTooFewLandmarks);
  if (too_few > kMaxShareWithFew) {
    judge.atMost(1.0, 0.0, 0.0,
                 percent(too_few) + " of the keyframes see fewer than " + std::to_string(kTooFewLandmarks) +
                     " landmarks: no vehicle can be localized there");
  } else {
    judge.check(few > kMaxShareWithFew, percent(few) + " of the keyframes see fewer than " +
                                            std::to_string(kFewLandmarks) + " landmarks");
  }

  judge.atMost(report.rms_px, kHighError_px, kTooHighError_px,
               "the error of reprojection is " + toText(report.rms_px, 2) +
                   " px RMS: is the rig's calibration that of this drive?");

  int64_t num_accepted = 0, num_contradict = 0;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    num_accepted += edge.accepted ? 1 : 0;
    num_contradict += edge.reason.rfind("contradicts", 0) == 0 ? 1 : 0;  // the edges, or the adjusted map
  }
  judge.check(num_accepted == 0, "no loop was found: the path drifts with its length");
  judge.check(num_accepted > 0 && shareOf(num_contradict, num_accepted) > kManyContradictions,
              std::to_string(num_contradict) + " verified loop edges contradict the map or the " +
                  std::to_string(num_accepted) + " accepted ones: places that look alike?");

  int64_t num_motions = 0;
  for (const int64_t count : report.num_motions) {
    num_motions += count;
  }
  const auto share_of_motion = [&](MotionHypothesis motion) {
    return shareOf(report.num_motions[static_cast<size_t>(motion)], num_motions);
  };
  judge.atMost(share_of_motion(MotionHypothesis::kOdometry), kManyByOdometry, kTooManyByOdometry,
               "the odometer alone moved " + percent(share_of_motion(MotionHypothesis::kOdometry)) +
                   " of the frames: too dark, too little texture, or covered lenses?");
  judge.check(share_of_motion(MotionHypothesis::kPlanar) > kManySlips,
              percent(share_of_motion(MotionHypothesis::kPlanar)) +
                  " of the frames moved as rolling wheels do not: slip, or a wrong rig?");

  const double distance = state.data.odometry_distance_scale, turn = state.data.odometry_turn_scale;
  judge.atMost(std::abs(distance - 1.0), kOddFactor, kWrongFactor,
               "true distances are " + toText(distance, 4) + " of what the odometer counted");
  judge.atMost(std::abs(turn - 1.0), kOddFactor, kWrongFactor,
               "true turns are " + toText(turn, 4) + " of what the odometer counted");

  const double without = shareOf(report.num_frames_without_odometry, report.num_frames);
  judge.atMost(without, kManySkipped, kTooManySkipped,
               percent(without) + " of the frames have no odometry and were not used");
  const double incomplete = shareOf(report.num_incomplete_frames, report.num_frames);
  judge.atMost(incomplete, kManySkipped, 1.0, percent(incomplete) + " of the frames lack a camera");
  judge.check(report.num_odometry_resets > 0,
              "the odometer started over " + std::to_string(report.num_odometry_resets) + " times");
  judge.check(report.num_late_images > 0,
              std::to_string(report.num_late_images) + " images came too late to be used");
  return verdict;
}

}  // namespace vcharge
