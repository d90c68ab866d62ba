#include "vcharge_mapping/map_difference.h"

#include <algorithm>
#include <cstdio>
#include <iterator>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

/// Calls `in_first`, `in_second` or `in_both` for the records of two lists, in order of their ids.
template <class Record, class InFirst, class InSecond, class InBoth>
void matchById(const std::vector<Record>& first, const std::vector<Record>& second, const InFirst& in_first,
               const InSecond& in_second, const InBoth& in_both) {
  auto a = first.begin();
  auto b = second.begin();
  while (a != first.end() || b != second.end()) {
    if (b == second.end() || (a != first.end() && a->id < b->id)) {
      in_first(*a++);
    } else if (a == first.end() || b->id < a->id) {
      in_second(*b++);
    } else {
      in_both(*a++, *b++);
    }
  }
}

std::vector<std::string> namesOf(const SparseMap& map) {
  std::vector<std::string> names;
  for (const MapSession& session : map.sessions()) {
    names.push_back(session.name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

size_t MapDifference::count(LandmarkChange::Kind kind) const {
  return static_cast<size_t>(std::count_if(
      landmarks.begin(), landmarks.end(), [&](const LandmarkChange& change) { return change.kind == kind; }));
}

MapDifference compareVersions(const SparseMap& from, const SparseMap& to, double min_move_m) {
  MapDifference result;
  const std::vector<std::string> before = namesOf(from);
  const std::vector<std::string> after = namesOf(to);
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                      std::back_inserter(result.new_sessions));
  std::set_difference(before.begin(), before.end(), after.begin(), after.end(),
                      std::back_inserter(result.lost_sessions));
  matchById(
      from.keyframes(), to.keyframes(), [&](const MapKeyframe&) { ++result.num_lost_keyframes; },
      [&](const MapKeyframe&) { ++result.num_new_keyframes; }, [](const MapKeyframe&, const MapKeyframe&) {});
  std::vector<double> moves_m;
  matchById(
      from.landmarks(), to.landmarks(),
      [&](const MapLandmark& lost) {
        result.landmarks.push_back({LandmarkChange::Kind::kVanished, lost.id, lost.position_m, 0.0});
      },
      [&](const MapLandmark& added) {
        result.landmarks.push_back({LandmarkChange::Kind::kAppeared, added.id, added.position_m, 0.0});
      },
      [&](const MapLandmark& old, const MapLandmark& kept) {
        const double moved_m = (kept.position_m - old.position_m).norm();
        moves_m.push_back(moved_m);
        if (moved_m > min_move_m) {
          result.landmarks.push_back({LandmarkChange::Kind::kMoved, kept.id, kept.position_m, moved_m});
        }
      });
  result.num_common_landmarks = moves_m.size();
  if (!moves_m.empty()) {
    result.median_move_m = quantile(moves_m, 0.5);
  }
  return result;
}

std::string toCsv(const MapDifference& difference) {
  static const char* const kNames[] = {"appeared", "vanished", "moved"};
  std::string text = "change,id,x_m,y_m,z_m,moved_by_m\n";
  char line[160];
  for (const LandmarkChange& change : difference.landmarks) {
    std::snprintf(line, sizeof(line), "%s,%d,%.4f,%.4f,%.4f,%.4f\n", kNames[static_cast<int>(change.kind)],
                  change.id, change.position_m.x(), change.position_m.y(), change.position_m.z(),
                  change.moved_by_m);
    text += line;
  }
  return text;
}

}  // namespace vcharge
