#include "vcharge_mapping/map_updater.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "update/landmark_presence.h"
#include "update/reduced_map.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Evidence of many drives is as easily overturned as that of a few.
constexpr double kMaxLogOdds = 4.0;
/// Two drives that saw all around a landmark but not it.
constexpr double kMinLogOdds = -3.0;
// Keyframes this close, and looking the same way, are at one place.
constexpr double kPlaceRadius_m = 1.0;
constexpr double kPlaceAngle_rad = 0.35;

/// Adds the evidence of the newest session of a map to its contents. Returns which landmarks are still
/// present enough.
std::vector<bool> weighLandmarks(const SparseMap& map, SparseMapContents* contents, UpdateReport* report) {
  const auto newest = static_cast<int32_t>(map.sessions().size()) - 1;
  const std::vector<PresenceEvidence> evidence = weighPresence(map, newest);
  std::vector<bool> keeps(contents->landmarks.size(), true);
  for (size_t i = 0; i < evidence.size(); ++i) {
    double& log_odds = contents->landmarks[i].presence_log_odds;
    log_odds = std::clamp(log_odds + evidence[i].log_odds, -kMaxLogOdds, kMaxLogOdds);
    keeps[i] = log_odds >= kMinLogOdds;
    report->num_seen_landmarks += evidence[i].is_seen ? 1 : 0;
    report->num_missed_landmarks += !evidence[i].is_seen && evidence[i].num_missed > 0 ? 1 : 0;
    report->num_removed_landmarks += keeps[i] ? 0 : 1;
  }
  return keeps;
}

/// Decides which keyframes a map needs: those of a limited number of sessions at each place.
class PlaceKeeper {
 public:
  PlaceKeeper(const SparseMap& map, const UpdateOptions& options)
      : map_(map),
        options_(options),
        newest_(static_cast<int32_t>(map.sessions().size()) - 1),
        is_in_newest_(map.landmarks().size(), false) {
    for (const MapObservation& observation : map.observations()) {
      if (map.keyframes()[observation.keyframe].session == newest_) {
        is_in_newest_[observation.landmark] = true;
      }
    }
  }

  std::vector<bool> neededKeyframes() const {
    std::vector<bool> needed(map_.keyframes().size(), true);
    for (size_t i = 0; i < needed.size(); ++i) {
      needed[i] = isNeeded(i);
    }
    return needed;
  }

 private:
  /// Landmarks that a session's keyframes observe at a place, and how many of them the newest session saw.
  struct Coverage {
    int64_t num_landmarks = 0, num_in_newest = 0;
    double ratio() const {
      return static_cast<double>(num_in_newest) / static_cast<double>(std::max<int64_t>(1, num_landmarks));
    }
  };

  bool isAtPlace(const MapKeyframe& a, const MapKeyframe& b) const {
    const RigidTransform between = a.map_from_vehicle.inverse() * b.map_from_vehicle;
    return between.translation().norm() <= kPlaceRadius_m &&
           angleOfRotation(between.rotation()) <= kPlaceAngle_rad;
  }

  std::map<int32_t, Coverage> coverageAt(const MapKeyframe& place) const {
    std::map<int32_t, Coverage> coverage;
    for (size_t k = 0; k < map_.keyframes().size(); ++k) {
      const MapKeyframe& keyframe = map_.keyframes()[k];
      if (!isAtPlace(place, keyframe)) {
        continue;
      }
      Coverage& of_session = coverage[keyframe.session];
      const auto begin = map_.observationsOf(k, 0).first;
      const auto end = map_.observationsOf(k, map_.rig().cameras.size() - 1).second;
      for (size_t i = begin; i < end; ++i) {
        ++of_session.num_landmarks;
        of_session.num_in_newest += is_in_newest_[map_.observations()[i].landmark] ? 1 : 0;
      }
    }
    return coverage;
  }

  /// The newest session stays, and of the others at a place those that it resembles least: the map keeps
  /// different light rather than the same light twice.
  bool isNeeded(size_t index) const {
    const MapKeyframe& keyframe = map_.keyframes()[index];
    if (keyframe.session == newest_) {
      return true;
    }
    std::map<int32_t, Coverage> coverage = coverageAt(keyframe);
    const bool has_newest = coverage.erase(newest_) > 0;
    const auto num_kept = static_cast<size_t>(options_.max_sessions_per_place - (has_newest ? 1 : 0));
    if (coverage.size() <= num_kept) {
      return true;
    }
    const double own = coverage.at(keyframe.session).ratio();
    // If two are equal, the later session stays.
    const auto num_better = std::count_if(coverage.begin(), coverage.end(), [&](const auto& other) {
      return other.second.ratio() < own || (other.second.ratio() == own && other.first > keyframe.session);
    });
    return static_cast<size_t>(num_better) < num_kept;
  }

  const SparseMap& map_;
  const UpdateOptions& options_;
  const int32_t newest_;
  std::vector<bool> is_in_newest_;
};

}  // namespace

UpdatedMap updateMap(const SparseMap& map, const SparseMap& session, const UpdateOptions& options,
                     const StageCallback& progress) {
  options.validate();
  if (session.sessions().size() != 1) {
    throw InputError("session: expected the map of one drive, has " +
                     std::to_string(session.sessions().size()));
  }
  const MergedMap merged = mergeSession(map, session, options.merge, progress);
  UpdatedMap result;
  result.report.merge = merged.report;
  if (!merged.report.joined) {
    throw InputError("session: it cannot update the map: " + merged.report.remark);
  }
  SparseMapContents contents = merged.map->contents();
  const std::vector<bool> keeps_landmark = weighLandmarks(*merged.map, &contents, &result.report);
  const auto present = reducedMap(SparseMap(std::move(contents)),
                                  std::vector<bool>(merged.map->keyframes().size(), true), keeps_landmark);
  result.map = reducedMap(*present, PlaceKeeper(*present, options).neededKeyframes(),
                          std::vector<bool>(present->landmarks().size(), true));
  result.report.num_removed_keyframes =
      static_cast<int64_t>(present->keyframes().size() - result.map->keyframes().size());
  result.report.num_forgotten_landmarks =
      static_cast<int64_t>(present->landmarks().size() - result.map->landmarks().size());
  result.report.num_new_landmarks = std::count_if(
      result.map->landmarks().begin(), result.map->landmarks().end(),
      [&](const MapLandmark& landmark) { return landmark.id >= map.contents().next_landmark_id; });
  return result;
}

}  // namespace vcharge
