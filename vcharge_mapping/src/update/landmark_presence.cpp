#include "update/landmark_presence.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <tbb/parallel_for.h>

namespace vcharge {
namespace {

/// Keyframes within this distance observe the same landmarks.
constexpr double kMaxDistance_m = 5.0;
// A view is nearly the same if directions and ranges differ by less.
constexpr double kMaxViewAngle_rad = 0.3;
constexpr double kMaxRangeRatio = 1.35;
/// Landmarks nearer to the border of an image are not expected in it.
constexpr double kBorder = 0.02;
/// Landmarks within this angle of a nearer one can be hidden by it.
constexpr double kOccluderAngle_rad = 0.05;
constexpr double kOccluderRangeRatio = 0.85;
/// A landmark is rarely found where it is not: the odds of one that was found.
constexpr double kSeenLogOdds = 2.0;
/// The views of one drive depend on each other: together they count at most so much.
constexpr double kMaxMissedLogOdds = 2.0;
/// An image that shows all of the expected landmarks is not to be trusted entirely either.
constexpr double kMaxFoundRatio = 0.8;

struct Expected {
  int32_t landmark;
  Eigen::Vector3d ray;  // in the map
  double range_m;
  bool is_seen;
};

class PresenceJudge {
 public:
  PresenceJudge(const SparseMap& map, int32_t session) : map_(map) {
    for (size_t k = 0; k < map.keyframes().size(); ++k) {
      (map.keyframes()[k].session == session ? new_ : old_).push_back(k);
    }
  }

  std::vector<PresenceEvidence> judge() const {
    struct View {
      std::vector<int32_t> seen, missed;
      double missed_log_odds = 0.0;
    };
    const size_t num_cameras = map_.rig().cameras.size();
    std::vector<View> views(new_.size() * num_cameras);
    tbb::parallel_for(size_t{0}, views.size(), [&](size_t i) {
      const std::vector<Expected> expected = expectedIn(new_[i / num_cameras], i % num_cameras);
      int64_t num_seen = 0;
      for (const Expected& landmark : expected) {
        num_seen += landmark.is_seen ? 1 : 0;
        (landmark.is_seen ? views[i].seen : views[i].missed).push_back(landmark.landmark);
      }
      // The prior of one found and one missed keeps images that show nothing from telling anything.
      const double found_ratio = static_cast<double>(num_seen) / (static_cast<double>(expected.size()) + 2.0);
      views[i].missed_log_odds = std::log(1.0 - std::min(kMaxFoundRatio, found_ratio));
    });
    std::vector<PresenceEvidence> evidence(map_.landmarks().size());
    for (const View& view : views) {
      for (const int32_t landmark : view.seen) {
        evidence[landmark].is_seen = true;
      }
      for (const int32_t landmark : view.missed) {
        ++evidence[landmark].num_missed;
        evidence[landmark].log_odds += view.missed_log_odds;
      }
    }
    for (PresenceEvidence& of_landmark : evidence) {
      of_landmark.log_odds =
          of_landmark.is_seen ? kSeenLogOdds : std::max(-kMaxMissedLogOdds, of_landmark.log_odds);
    }
    return evidence;
  }

 private:
  Eigen::Vector3d cameraCentre(size_t keyframe, size_t camera) const {
    return map_.keyframes()[keyframe].map_from_vehicle *
           map_.rig().cameras[camera].vehicle_from_camera->translation();
  }

  bool isInImage(size_t camera, const RigidTransform& camera_from_map, const Eigen::Vector3d& point) const {
    const RigCamera& rig_camera = map_.rig().cameras[camera];
    const Eigen::Vector3d in_camera = camera_from_map * point;
    Eigen::Vector2d pixel;
    if (in_camera.z() < std::cos(0.5 * rig_camera.field_of_view_rad) * in_camera.norm() ||
        !rig_camera.model.project(in_camera, &pixel)) {
      return false;
    }
    const double border_px = kBorder * rig_camera.image_size_px.width;
    return pixel.x() >= border_px && pixel.y() >= border_px &&
           pixel.x() < rig_camera.image_size_px.width - border_px &&
           pixel.y() < rig_camera.image_size_px.height - border_px &&
           (rig_camera.mask.empty() ||
            rig_camera.mask.at<uchar>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x())) != 0);
  }

  /// Landmarks of earlier sessions that a camera should see at a keyframe of this one, and none in front of
  /// which it sees another.
  std::vector<Expected> expectedIn(size_t keyframe, size_t camera) const {
    const RigidTransform map_from_camera =
        map_.keyframes()[keyframe].map_from_vehicle * *map_.rig().cameras[camera].vehicle_from_camera;
    const RigidTransform camera_from_map = map_from_camera.inverse();
    const Eigen::Vector3d& centre = map_from_camera.translation();
    const auto [begin, end] = map_.observationsOf(keyframe, camera);
    std::unordered_map<int32_t, Expected> expected;
    for (const size_t other : old_) {
      if ((map_.keyframes()[other].map_from_vehicle.translation() -
           map_.keyframes()[keyframe].map_from_vehicle.translation())
              .norm() > kMaxDistance_m) {
        continue;
      }
      for (size_t other_camera = 0; other_camera < map_.rig().cameras.size(); ++other_camera) {
        const Eigen::Vector3d other_centre = cameraCentre(other, other_camera);
        const auto [first, last] = map_.observationsOf(other, other_camera);
        for (size_t i = first; i < last; ++i) {
          const int32_t landmark = map_.observations()[i].landmark;
          const Eigen::Vector3d& point = map_.landmarks()[landmark].position_m;
          const Eigen::Vector3d from_here = point - centre;
          const Eigen::Vector3d from_there = point - other_centre;
          const double range = from_here.norm();
          const double other_range = from_there.norm();
          if (range < kMaxRangeRatio * other_range && other_range < kMaxRangeRatio * range &&
              from_here.dot(from_there) > std::cos(kMaxViewAngle_rad) * range * other_range &&
              expected.count(landmark) == 0 && isInImage(camera, camera_from_map, point)) {
            expected.emplace(landmark, Expected{landmark, from_here / range, range, false});
          }
        }
      }
    }
    std::vector<std::pair<Eigen::Vector3d, double>> shown;  // rays and ranges of what this image shows
    for (size_t i = begin; i < end; ++i) {
      const int32_t landmark = map_.observations()[i].landmark;
      const Eigen::Vector3d from_here = map_.landmarks()[landmark].position_m - centre;
      shown.emplace_back(from_here.normalized(), from_here.norm());
      const auto found = expected.find(landmark);
      if (found != expected.end()) {
        found->second.is_seen = true;
      }
    }
    std::vector<Expected> result;
    for (const auto& [landmark, view] : expected) {
      const bool is_occluded = std::any_of(shown.begin(), shown.end(), [&, &v = view](const auto& other) {
        return other.second < kOccluderRangeRatio * v.range_m &&
               other.first.dot(v.ray) > std::cos(kOccluderAngle_rad);
      });
      if (view.is_seen || !is_occluded) {
        result.push_back(view);
      }
    }
    std::sort(result.begin(), result.end(),
              [](const Expected& a, const Expected& b) { return a.landmark < b.landmark; });
    return result;
  }

  const SparseMap& map_;
  std::vector<size_t> old_, new_;
};

}  // namespace

std::vector<PresenceEvidence> weighPresence(const SparseMap& map, int32_t session) {
  return PresenceJudge(map, session).judge();
}

}  // namespace vcharge
