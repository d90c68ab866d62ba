#include "map_change_markers.h"

#include <array>

namespace vcharge {
namespace {

constexpr double kPointSize_m = 0.1;

struct Style {
  LandmarkChange::Kind kind;
  const char* name;
  std::array<float, 3> colour;
};

constexpr std::array<Style, 3> kStyles = {{{LandmarkChange::Kind::kAppeared, "appeared", {0.1F, 0.9F, 0.1F}},
                                           {LandmarkChange::Kind::kVanished, "vanished", {1.0F, 0.2F, 0.1F}},
                                           {LandmarkChange::Kind::kMoved, "moved", {1.0F, 0.9F, 0.1F}}}};

}  // namespace

visualization_msgs::MarkerArray makeChangeMarkers(const MapDifference& difference) {
  visualization_msgs::MarkerArray markers;
  for (const Style& style : kStyles) {
    visualization_msgs::Marker marker;
    marker.header.frame_id = "map";
    marker.ns = style.name;
    marker.type = visualization_msgs::Marker::POINTS;
    marker.pose.orientation.w = 1.0;
    marker.scale.x = marker.scale.y = kPointSize_m;
    marker.color.r = style.colour[0];
    marker.color.g = style.colour[1];
    marker.color.b = style.colour[2];
    marker.color.a = 1.0F;
    for (const LandmarkChange& change : difference.landmarks) {
      if (change.kind == style.kind) {
        geometry_msgs::Point point;
        point.x = change.position_m.x();
        point.y = change.position_m.y();
        point.z = change.position_m.z();
        marker.points.push_back(point);
      }
    }
    marker.action =
        marker.points.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
    markers.markers.push_back(marker);
  }
  return markers;
}

}  // namespace vcharge
