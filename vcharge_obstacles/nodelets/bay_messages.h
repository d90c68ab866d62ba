#pragma once

#include <string>
#include <vector>

#include <vcharge_msgs/ParkingBays.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_obstacles/bay_monitor.h"
#include "vcharge_obstacles/gap_finder.h"

namespace vcharge {

vcharge_msgs::ParkingBays toMessage(const std::vector<MonitoredBay>& bays, Timestamp stamp,
                                    const std::string& frame_id);

/// Gaps as bays that are free. Their numbers hold for one message only.
vcharge_msgs::ParkingBays toMessage(const std::vector<ParkingGap>& gaps, Timestamp stamp,
                                    const std::string& frame_id);

/// Outlines of the bays: green if free, red if occupied, gray if unknown. Replaces earlier markers.
visualization_msgs::MarkerArray toMarkers(const std::vector<MonitoredBay>& bays, Timestamp stamp,
                                          const std::string& frame_id);

}  // namespace vcharge
