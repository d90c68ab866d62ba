#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <nav_msgs/OccupancyGrid.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <vcharge_msgs/LocalizationStatus.h>
#include <vcharge_msgs/ParkingBays.h>
#include <visualization_msgs/MarkerArray.h>
#include <pluginlib/class_list_macros.hpp>

#include "bay_messages.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_obstacles/bay_monitor.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/obstacle_conversions.h"

namespace vcharge {

/// Tells which parking bays of a map are free: from obstacle_nodelet's /obstacles/grid, where
/// /localization/status says that the pose is certain enough, and the transform from the grid's frame to that
/// of the bays on /tf. Publishes /parking/bays (vcharge_msgs/ParkingBays, latched) and /parking/markers twice
/// per second and when a state changes. Parameter: ~bays (path of a file of map_bays).
class BayNodelet : public Nodelet {
 public:
  BayNodelet() : Nodelet("parking") {}
  ~BayNodelet() override { end(); }

 private:
  static constexpr double kPeriod_s = 0.5, kMaxStatusAge_s = 1.0;
  static constexpr const char* kGridTopic = "/obstacles/grid";

  void start() override {
    const ParkingBays bays = readParkingBays(requireParameter("bays", "the path of a file of map_bays"));
    frame_id_ = bays.frame_id;
    monitor_ = std::make_unique<BayMonitor>(bays);
    listener_ = std::make_unique<tf2_ros::TransformListener>(transforms_);
    bays_ = advertiseLatched<vcharge_msgs::ParkingBays>("/parking/bays");
    markers_ = advertiseLatched<visualization_msgs::MarkerArray>("/parking/markers");
    publish(Timestamp());
    addDiagnostics(
        "", [this] { return report(); }, Threads::kOne);
    subscribe<vcharge_msgs::LocalizationStatus>(
        "/localization/status", 1,
        [this](const vcharge_msgs::LocalizationStatusConstPtr& status) { status_ = *status; });
    subscribe<nav_msgs::OccupancyGrid>(
        kGridTopic, 1, [this](const nav_msgs::OccupancyGridConstPtr& grid) { addGrid(*grid); });
  }

  void addGrid(const nav_msgs::OccupancyGrid& grid) {
    const ObstacleMap map = fromMessage(grid, kGridTopic);
    bool has_changed = false;
    is_localized_ = std::abs((grid.header.stamp - status_.header.stamp).toSec()) <= kMaxStatusAge_s &&
                    status_.position_sigma_m <= BayMonitor::kMaxPositionSigma_m &&
                    transforms_.canTransform(frame_id_, grid.header.frame_id, ros::Time(0));
    if (is_localized_) {
      const auto transform = transforms_.lookupTransform(frame_id_, grid.header.frame_id, ros::Time(0));
      has_changed = monitor_->add(map, fromMessage(transform.transform, "/tf"));
    }
    const double since_s = toSeconds(map.stamp - published_);
    if (has_changed || since_s >= kPeriod_s || since_s < 0.0) {
      publish(map.stamp);
    }
  }

  void publish(Timestamp stamp) {
    published_ = stamp;
    bays_.publish(toMessage(monitor_->bays(), stamp, frame_id_));
    markers_.publish(toMarkers(monitor_->bays(), stamp, frame_id_));
  }

  DriveMonitor::Report report() {
    const auto count = [&](BayState state) {
      const auto& bays = monitor_->bays();
      return std::to_string(std::count_if(bays.begin(), bays.end(),
                                          [&](const MonitoredBay& bay) { return bay.bay.state == state; }));
    };
    DriveMonitor::Report report;
    report.message = is_localized_ ? count(BayState::kFree) + " bays are free"
                                   : "no certain pose in the map of the bays: their states are as last seen";
    report.values.emplace_back("free", count(BayState::kFree));
    report.values.emplace_back("occupied", count(BayState::kOccupied));
    report.values.emplace_back("unknown", count(BayState::kUnknown));
    return report;
  }

  std::string frame_id_;
  std::unique_ptr<BayMonitor> monitor_;
  vcharge_msgs::LocalizationStatus status_;
  bool is_localized_ = false;
  Timestamp published_;
  ros::Publisher bays_, markers_;
  tf2_ros::Buffer transforms_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::BayNodelet, nodelet::Nodelet)
