#include "bay_messages.h"

#include "marker_shapes.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

std_msgs::ColorRGBA colourOf(BayState state) {
  std_msgs::ColorRGBA colour;
  colour.a = 1.0F;
  colour.r = state == BayState::kFree ? 0.1F : state == BayState::kOccupied ? 0.9F : 0.5F;
  colour.g = state == BayState::kFree ? 0.8F : state == BayState::kOccupied ? 0.1F : 0.5F;
  colour.b = state == BayState::kUnknown ? 0.5F : 0.1F;
  return colour;
}

}  // namespace

vcharge_msgs::ParkingBays toMessage(const std::vector<MonitoredBay>& bays, Timestamp stamp,
                                    const std::string& frame_id) {
  vcharge_msgs::ParkingBays message;
  message.header.stamp = fromTimestamp(stamp);
  message.header.frame_id = frame_id;
  for (const MonitoredBay& monitored : bays) {
    const ParkingBay& bay = monitored.bay;
    vcharge_msgs::ParkingBay entry;
    entry.id = bay.id;
    entry.row = bay.row;
    entry.kind = static_cast<uint8_t>(bay.kind);
    entry.state = static_cast<uint8_t>(bay.state);
    if (monitored.since && monitored.observed) {
      entry.since = fromTimestamp(*monitored.since);
      entry.observed = fromTimestamp(*monitored.observed);
    }
    for (size_t i = 0; i < bay.corners_m.size(); ++i) {
      entry.corners[i].x = static_cast<float>(bay.corners_m[i].x());
      entry.corners[i].y = static_cast<float>(bay.corners_m[i].y());
    }
    entry.entry_sigma_m = bay.entry_sigma_m;
    entry.end_sigma_m = bay.end_sigma_m;
    entry.confidence = bay.confidence;
    message.bays.push_back(entry);
  }
  return message;
}

vcharge_msgs::ParkingBays toMessage(const std::vector<ParkingGap>& gaps, Timestamp stamp,
                                    const std::string& frame_id) {
  std::vector<MonitoredBay> bays;
  for (const ParkingGap& gap : gaps) {
    MonitoredBay bay{{}, stamp, stamp};
    bay.bay.id = static_cast<uint32_t>(bays.size() + 1);
    bay.bay.kind = gap.kind;
    bay.bay.state = BayState::kFree;
    bay.bay.corners_m = gap.corners_m;
    bay.bay.entry_sigma_m = bay.bay.end_sigma_m = gap.length_sigma_m;
    bay.bay.confidence = 1.0;
    bays.push_back(bay);
  }
  return toMessage(bays, stamp, frame_id);
}

visualization_msgs::MarkerArray toMarkers(const std::vector<MonitoredBay>& bays, Timestamp stamp,
                                          const std::string& frame_id) {
  visualization_msgs::MarkerArray markers;
  visualization_msgs::Marker lines =
      makeMarker(stamp, frame_id, "bays", visualization_msgs::Marker::LINE_LIST);
  lines.scale.x = 0.08;
  for (const MonitoredBay& monitored : bays) {
    const Quadrangle& corners_m = monitored.bay.corners_m;
    for (size_t i = 0; i < corners_m.size(); ++i) {
      lines.points.push_back(pointOf(corners_m[i], 0.02));
      lines.points.push_back(pointOf(corners_m[(i + 1) % corners_m.size()], 0.02));
      lines.colors.insert(lines.colors.end(), 2, colourOf(monitored.bay.state));
    }
  }
  if (lines.points.empty()) {
    lines.action = visualization_msgs::Marker::DELETE;
  }
  markers.markers.push_back(lines);
  return markers;
}

}  // namespace vcharge
