#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_mapping/mapping_session.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_reconstruction/reconstruction_state.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// Shows a map on /mapping/landmarks, /mapping/trajectory and /mapping/loop_edges, latched, in the frame
/// `map`.
class MappingTopics {
 public:
  explicit MappingTopics(ros::NodeHandle* node);

  /// The path and the newest landmarks of a drive that goes on; at most twice a second, to keep the cost low.
  void publish(const ReconstructionState& state, const SparseMapperOptions& options);
  void publish(const SparseMap& map) const;

 private:
  ros::WallTime last_shown_;
  ros::Publisher landmarks_, trajectory_, loop_edges_;
};

/// What a session tells in /diagnostics; its troubles come first.
DriveMonitor::Report toReport(const MappingSession::Status& status);

}  // namespace vcharge
