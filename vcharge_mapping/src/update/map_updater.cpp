#include "vcharge_mapping/map_updater.h"

#include <algorithm>
#include <vector>

#include "update/landmark_presence.h"
#include "update/reduced_map.h"
#include "vcharge_core/base/error.h"
#include "vcharge_mapping/session_limit.h"

namespace vcharge {
namespace {

/// Evidence of many drives is as easily overturned as that of a few.
constexpr double kMaxLogOdds = 4.0;
/// Two drives that saw all around a landmark but not it.
constexpr double kMinLogOdds = -3.0;

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
  result.map = limitSessionsPerPlace(present, options.max_sessions_per_place);
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
