#include "mapping_topics.h"

#include <string>

#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_reconstruction/live_view.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {
namespace {

constexpr double kShowPeriod_s = 0.5;
constexpr int kShownKeyframes = 20;

}  // namespace

MappingTopics::MappingTopics(ros::NodeHandle* node)
    : landmarks_(node->advertise<sensor_msgs::PointCloud2>("/mapping/landmarks", 1, true)),
      trajectory_(node->advertise<nav_msgs::Path>("/mapping/trajectory", 1, true)),
      loop_edges_(node->advertise<visualization_msgs::MarkerArray>("/mapping/loop_edges", 1, true)) {}

void MappingTopics::publish(const ReconstructionState& state, const SparseMapperOptions& options) {
  if ((ros::WallTime::now() - last_shown_).toSec() >= kShowPeriod_s) {
    last_shown_ = ros::WallTime::now();
    trajectory_.publish(makePath(keyframePath(state)));
    landmarks_.publish(makeLandmarkCloud(recentLandmarks(state, options.triangulation, kShownKeyframes)));
  }
}

void MappingTopics::publish(const SparseMap& map) const {
  landmarks_.publish(makeLandmarkCloud(map));
  trajectory_.publish(makePath(map));
  loop_edges_.publish(makeLoopEdgeMarkers(map));
}

DriveMonitor::Report toReport(const MappingSession::Status& status) {
  DriveMonitor::Report report;
  report.message = status.message;
  for (const std::string& trouble : {status.not_kept, status.failure}) {
    if (!trouble.empty()) {
      report.level = DriveMonitor::Level::kError;
      report.message = trouble + "; " + report.message;
    }
  }
  for (const auto& [name, count] : status.counts) {
    report.values.emplace_back(name, std::to_string(count));
  }
  return report;
}

}  // namespace vcharge
