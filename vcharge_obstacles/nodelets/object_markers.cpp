#include "object_markers.h"

#include <cstdio>
#include <string>

#include "marker_shapes.h"

namespace vcharge {
namespace {

using visualization_msgs::Marker;

Marker makeMarker(const ObjectFrame& frame, const std::string& kind, int type, int id) {
  Marker marker = makeMarker(frame.stamp, "odom", kind, type);
  marker.id = id;
  return marker;
}

}  // namespace

visualization_msgs::MarkerArray toMarkers(const ObjectFrame& frame) {
  visualization_msgs::MarkerArray markers;
  Marker all = makeMarker(frame, "objects", Marker::LINE_LIST, 0);
  all.action = Marker::DELETEALL;
  markers.markers.push_back(all);
  for (const TrackedObject& object : frame.objects) {
    const auto id = static_cast<int>(object.id);
    Marker outline = makeMarker(frame, "outlines", Marker::LINE_LIST, id);
    outline.scale.x = 0.05;
    outline.color.r = 1.0F;
    outline.color.g = object.is_standing ? 0.8F : 0.2F;
    for (size_t i = 0; i < object.footprint_m.size(); ++i) {
      const Eigen::Vector2d& a = object.footprint_m[i];
      const Eigen::Vector2d& b = object.footprint_m[(i + 1) % object.footprint_m.size()];
      for (const double z_m : {0.0, object.height_m}) {
        outline.points.push_back(pointOf(a, z_m));
        outline.points.push_back(pointOf(b, z_m));
      }
      outline.points.push_back(pointOf(a, 0.0));
      outline.points.push_back(pointOf(a, object.height_m));
    }
    markers.markers.push_back(outline);
    const Eigen::Vector2d middle = object.frame_from_object.translation().head<2>();
    Marker velocity = makeMarker(frame, "velocities", Marker::ARROW, id);
    velocity.scale.x = 0.06;
    velocity.scale.y = 0.15;
    velocity.color = outline.color;
    velocity.points = {pointOf(middle, 0.1), pointOf(middle + object.velocity_m_per_s.head<2>(), 0.1)};
    markers.markers.push_back(velocity);
    Marker text = makeMarker(frame, "descriptions", Marker::TEXT_VIEW_FACING, id);
    text.scale.z = 0.3;
    text.color.r = text.color.g = text.color.b = 1.0F;
    text.pose.position = pointOf(middle, object.height_m + 0.3);
    char words[64];
    std::snprintf(words, sizeof(words), "%s %u  %.1f m/s", nameOf(object.object_class).c_str(), object.id,
                  object.velocity_m_per_s.norm());
    text.text = words;
    markers.markers.push_back(text);
  }
  return markers;
}

}  // namespace vcharge
