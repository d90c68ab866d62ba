#include "vcharge_mapping/session_merger.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "merge/appended_session.h"
#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"
#include "vcharge_reconstruction/reconstruction_steps.h"

namespace vcharge {
namespace {

constexpr int kNumStages = 5;
/// Deviation of a map's observations that were aligned with their landmark's patch. Others err more; the loss
/// lets them count little.
constexpr double kObservationSigma_px = 0.15;
// Larger differences of a camera's calibration make it another rig.
constexpr double kMaxShift_m = 0.03;
constexpr double kMaxTurn_rad = 0.01;
constexpr double kMaxIntrinsicsDifference = 0.01;  // relative to the larger parameter, and absolute
/// Keyframes of map and session closer than this, and looking the same way, see the same things.
constexpr double kMeeting_m = 1.5;
constexpr double kMeeting_rad = 0.5;

bool isSameLens(const RigCamera& a, const RigCamera& b) {
  if (a.model.name() != b.model.name() || a.image_size_px != b.image_size_px) {
    return false;
  }
  const Eigen::VectorXd first = a.model.parameters();
  const Eigen::VectorXd second = b.model.parameters();
  return first.size() == second.size() &&
         ((first - second).array().abs() <=
          kMaxIntrinsicsDifference * (1.0 + first.array().abs().max(second.array().abs())))
             .all();
}

class SessionMerger {
 public:
  SessionMerger(const SparseMap& map, const SparseMap& session, const MergeOptions& options,
                const StageCallback& progress)
      : options_(options),
        stages_(kNumStages, progress, &state_.report),
        apart_(appendSession(map, session)),
        first_of_new_(static_cast<int32_t>(map.keyframes().size())) {
    state_.data = reconstructionOf(apart_, kObservationSigma_px);
  }

  MergedMap merge() {
    stages_.run("common places", [&] { findCommonPlaces(); });
    stages_.run("pose graph", [&] { closeLoopsBetween(); });
    if (!report_.joined) {
      report_.remark =
          report_.num_undecided_loops > 0
              ? "common places are neither confirmed nor contradicted: too few, or more than one "
                "explanation remains"
              : "no common places";
      return keptApart();
    }
    stages_.run("landmark search", [&] {
      report_.chance_ratio = chanceRatio();
      searchLandmarksBetween(options_.search, first_of_new_, &state_.data);
      report_.common_ratio = commonRatio(state_.data);
    });
    if (report_.common_ratio <= options_.min_common_over_chance * report_.chance_ratio) {
      report_.joined = false;
      report_.remark = "places that look alike, but few landmarks are the same";
      return keptApart();
    }
    stages_.run("adjustment", [&] { adjust(); });
    stages_.run("last adjustment", [&] {
      // Within map and session, too: their poses are better now.
      searchLandmarks(options_.search, &state_.data);
      // A session whose poses were adjusted before keeps its shape where it shows little, as in the dark.
      adjust(estimateOdometryNoise(options_.bundle, state_.data));
      checkLoops(state_.data, &state_.report.loop_edges);
    });
    std::sort(state_.report.loop_edges.begin(), state_.report.loop_edges.end(),
              [](const auto& a, const auto& b) {
                return std::make_pair(a.second, a.first) < std::make_pair(b.second, b.first);
              });
    return {assembleMap(state_, apart_.contents().feature_options), report_};
  }

 private:
  MergedMap keptApart() { return {std::make_shared<const SparseMap>(apart_), report_}; }

  void findCommonPlaces() {
    between_ = findLoopsBetween(options_.loops, trainVocabulary(state_.data), state_.data, first_of_new_,
                                [&](double fraction) { stages_.tell("common places", fraction); });
  }

  /// The loops that map and session closed before, as their adjusted poses have them.
  std::vector<LoopEdge> loopsWithin() const {
    std::vector<LoopEdge> edges;
    for (const MapLoopEdge& from : apart_.contents().loop_edges) {
      LoopEdge edge;
      edge.first = from.first;
      edge.second = from.second;
      edge.first_from_second = state_.data.keyframes[from.first].map_from_vehicle.inverse() *
                               state_.data.keyframes[from.second].map_from_vehicle;
      edge.num_inliers = from.num_inliers;
      edges.push_back(edge);
    }
    return edges;
  }

  void closeLoopsBetween() {
    std::vector<LoopEdge> edges = loopsWithin();
    const size_t num_within = edges.size();
    edges.insert(edges.end(), between_.begin(), between_.end());
    closeLoops(&edges, &state_.data);
    std::vector<std::pair<int32_t, int32_t>> joined;
    for (size_t i = num_within; i < edges.size(); ++i) {
      const LoopEdge& edge = edges[i];
      if (edge.accepted) {
        ++report_.num_accepted_loops;
        joined.emplace_back(state_.data.keyframes[edge.first].session,
                            state_.data.keyframes[edge.second].session);
      } else if (edge.reason == kUndecidedLoop) {
        ++report_.num_undecided_loops;
      } else {
        ++report_.num_rejected_loops;
      }
    }
    report_.joined = !joined.empty();
    joinComponents(joined, &state_.data.sessions);
    // The measured transforms of old loops are kept, not the adjusted ones.
    for (size_t i = 0; i < num_within; ++i) {
      edges[i].first_from_second = apart_.contents().loop_edges[i].first_from_second;
      edges[i].accepted = true;
      edges[i].reason.clear();
    }
    state_.report.loop_edges = std::move(edges);
    // Landmarks move with the keyframe that observes them first.
    for (size_t t = 0; t < state_.data.tracks.size(); ++t) {
      Track& track = state_.data.tracks[t];
      const int32_t keyframe = track.observations.front().keyframe;
      track.position_m = state_.data.keyframes[keyframe].map_from_vehicle *
                         (apart_.keyframes()[keyframe].map_from_vehicle.inverse() * *track.position_m);
    }
  }

  void adjust(const OdometryNoise& odometry = {}) {
    const BundleAdjustmentSummary summary = adjustBundle(options_.bundle, &state_.data, odometry);
    recordAdjustment(summary, &state_.report);
    report_.rms_px = summary.rms_px;
  }

  bool meetsMap(const Keyframe& keyframe) const {
    return std::any_of(state_.data.keyframes.begin(), state_.data.keyframes.begin() + first_of_new_,
                       [&](const Keyframe& other) {
                         const RigidTransform between =
                             other.map_from_vehicle.inverse() * keyframe.map_from_vehicle;
                         return between.translation().norm() < kMeeting_m &&
                                angleOfRotation(between.rotation()) < kMeeting_rad;
                       });
  }

  /// Part of the session's observations, where it meets the map, whose landmark both have.
  double commonRatio(const ReconstructionData& data) const {
    std::vector<char> is_in_map(data.tracks.size(), 0);
    for (size_t t = 0; t < data.tracks.size(); ++t) {
      for (const TrackObservation& observation : data.tracks[t].observations) {
        is_in_map[t] |= observation.keyframe < first_of_new_ ? 1 : 0;
      }
    }
    int64_t num_common = 0;
    int64_t num_observed = 0;
    for (auto k = static_cast<size_t>(first_of_new_); k < data.keyframes.size(); ++k) {
      if (!meetsMap(state_.data.keyframes[k])) {
        continue;
      }
      for (const KeyframeImage& image : data.keyframes[k].images) {
        for (const int32_t track : image.track_of_feature) {
          ++num_observed;
          num_common += track >= 0 && is_in_map[track] != 0 ? 1 : 0;
        }
      }
    }
    return num_observed == 0 ? 0.0 : static_cast<double>(num_common) / static_cast<double>(num_observed);
  }

  /// The common ratio that the search finds by chance: with the session's vehicle turned around everywhere.
  double chanceRatio() const {
    ReconstructionData turned = state_.data;
    const RigidTransform around = RigidTransform::planar(0.0, 0.0, M_PI);
    for (auto k = static_cast<size_t>(first_of_new_); k < turned.keyframes.size(); ++k) {
      turned.keyframes[k].map_from_vehicle = turned.keyframes[k].map_from_vehicle * around;
    }
    for (Track& track : turned.tracks) {
      const size_t first = static_cast<size_t>(track.observations.front().keyframe);
      if (track.observations.front().keyframe >= first_of_new_) {
        track.position_m = turned.keyframes[first].map_from_vehicle *
                           (state_.data.keyframes[first].map_from_vehicle.inverse() * *track.position_m);
      }
    }
    searchLandmarksBetween(options_.search, first_of_new_, &turned);
    return commonRatio(turned);
  }

  const MergeOptions options_;
  ReconstructionState state_;
  StageRunner stages_;
  const SparseMap apart_;
  const int32_t first_of_new_;
  std::vector<LoopEdge> between_;
  MergeReport report_;
};

}  // namespace

void requireSameRig(const SparseMap& map, const SparseMap& session, const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(name + ": recorded with another rig than the map: " + what);
  };
  if (map.rig().cameras.size() != session.rig().cameras.size()) {
    refuse(std::to_string(session.rig().cameras.size()) + " cameras, expected " +
           std::to_string(map.rig().cameras.size()));
  }
  for (size_t i = 0; i < map.rig().cameras.size(); ++i) {
    const RigCamera& expected = map.rig().cameras[i];
    const RigCamera& camera = session.rig().cameras[i];
    if (camera.name != expected.name) {
      refuse("camera " + camera.name + ", expected " + expected.name);
    }
    if (!isSameLens(camera, expected)) {
      refuse("camera " + camera.name + " has other intrinsics");
    }
    const RigidTransform between = expected.vehicle_from_camera->inverse() * *camera.vehicle_from_camera;
    if (between.translation().norm() > kMaxShift_m || angleOfRotation(between.rotation()) > kMaxTurn_rad) {
      std::ostringstream text;
      text << "camera " << camera.name << " is " << 100.0 * between.translation().norm() << " cm and "
           << angleOfRotation(between.rotation()) / M_PI * 180.0 << " degrees elsewhere";
      refuse(text.str());
    }
  }
  if (session.contents().feature_options != map.contents().feature_options) {
    throw InputError(name +
                     ": its features are of another kind than the map's: build it with the same options");
  }
}

MergedMap mergeSession(const SparseMap& map, const SparseMap& session, const MergeOptions& options,
                       const StageCallback& progress) {
  options.validate();
  requireSameRig(map, session, "session");
  if (map.keyframes().empty() || session.keyframes().empty()) {
    throw InputError("session: expected keyframes in the map and in the session");
  }
  return SessionMerger(map, session, options, progress).merge();
}

}  // namespace vcharge
