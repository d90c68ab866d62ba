#include "corridor_messages.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "marker_shapes.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr double kStripStep_m = 0.1;
// Above the grid, which rviz draws at height zero.
constexpr double kStripHeight_m = 0.03;

vcharge_msgs::CorridorDirection toMessage(const CorridorDirection& direction) {
  vcharge_msgs::CorridorDirection message;
  message.known_free_m = direction.known_free_m;
  message.free_beyond_rim_m = direction.free_beyond_rim_m;
  message.occupied_m = direction.occupied_m;
  message.unknown_fraction = direction.unknown_fraction;
  message.oldest_age_s = direction.oldest_age_s;
  if (direction.crossing) {
    message.has_crossing = 1;
    message.crossing_id = direction.crossing->id;
    message.crossing_time_s = direction.crossing->time_s;
    message.crossing_travel_m = direction.crossing->travel_m;
  }
  return message;
}

std_msgs::ColorRGBA colourAt(const CorridorDirection& direction, double travel_m) {
  std_msgs::ColorRGBA colour;
  colour.a = 0.4F;
  const bool is_free = travel_m < direction.known_free_m ||
                       (travel_m >= kBlindRim_m && travel_m < direction.free_beyond_rim_m);
  colour.r = is_free ? 0.0F : 1.0F;
  colour.g = travel_m < direction.occupied_m ? 1.0F : 0.0F;
  return colour;
}

}  // namespace

vcharge_msgs::Corridor toMessage(const Corridor& corridor, Timestamp stamp,
                                 const std::string& vehicle_frame) {
  vcharge_msgs::Corridor message;
  message.header.stamp = fromTimestamp(stamp);
  message.header.frame_id = vehicle_frame;
  message.curvature_per_m = corridor.curvature_per_m;
  message.front_m = corridor.outline.front_m;
  message.rear_m = corridor.outline.rear_m;
  message.half_width_m = corridor.outline.half_width_m;
  message.forward = toMessage(corridor.forward);
  message.backward = toMessage(corridor.backward);
  return message;
}

visualization_msgs::MarkerArray toMarkers(const Corridor& corridor, Timestamp stamp,
                                          const std::string& vehicle_frame) {
  visualization_msgs::MarkerArray markers;
  for (const bool is_forward : {true, false}) {
    visualization_msgs::Marker strip =
        makeMarker(stamp, vehicle_frame, is_forward ? "corridor_forward" : "corridor_backward",
                   visualization_msgs::Marker::TRIANGLE_LIST);
    strip.scale.x = strip.scale.y = strip.scale.z = 1.0;
    const CorridorDirection& direction = is_forward ? corridor.forward : corridor.backward;
    const int steps = static_cast<int>(std::lround(kCorridorMarker_m / kStripStep_m));
    for (int step = 0; step < steps; ++step) {
      const auto near = corridor.bumperAt(is_forward, step * kStripStep_m);
      const auto far = corridor.bumperAt(is_forward, (step + 1) * kStripStep_m);
      for (const Eigen::Vector2d& corner_m : {near[0], near[1], far[0], far[0], near[1], far[1]}) {
        strip.points.push_back(pointOf(corner_m, kStripHeight_m));
        strip.colors.push_back(colourAt(direction, (step + 0.5) * kStripStep_m));
      }
    }
    markers.markers.push_back(strip);
  }
  return markers;
}

}  // namespace vcharge
