#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tbb/task_group.h>
#include <Eigen/Geometry>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_dense/height_map_options.h"
#include "vcharge_dense/octomap_builder.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {

/// Input and convergence of a height map.
struct HeightMapStatistics {
  size_t num_views = 0;     ///< number of fused range maps
  size_t num_reused = 0;    ///< number of fused range maps reused from an earlier run
  size_t num_observed = 0;  ///< number of observed cells
  size_t num_solid = 0;     ///< number of cells with an obstacle but without a height
  int label_iterations = 0, height_iterations = 0;
  double label_gap_per_cell = 0.0, height_gap_per_cell = 0.0;
  bool converged = false;                 ///< both passes reached their duality gap
  std::map<std::string, double> times_s;  ///< wall time of each stage
};

struct HeightMapResult {
  HeightMap map;
  cv::Mat states;  ///< CV_8UC1, values of CellState
  std::unique_ptr<OctomapBuilder> octomap;
  HeightMapStatistics statistics;
};

/// Turns a drive into a height map (paper, section Height Map Fusion). Range maps are computed during the
/// drive and kept in a folder, so that memory does not limit the drive and an interrupted run can resume;
/// finish() fuses them. Used by build_height_map and height_map_nodelet. Not thread safe.
class HeightMapper : public DriveConsumer {
 public:
  /// `work_folder` holds the range maps; those of the same drive, rig, poses and options are reused.
  /// `drive_name` identifies the drive, e.g. by the bag's hash; with an empty name nothing is reused.
  /// Throws InputError like RangeMapper, and std::invalid_argument for bad options.
  HeightMapper(std::shared_ptr<const CameraRig> rig, const HeightMapOptions& options, std::string work_folder,
               const std::string& drive_name);
  ~HeightMapper() override;

  /// Replaces the odometry's poses. The map is then in the frame `frame_id` instead of "odom".
  void setTrajectory(const Trajectory& map_from_vehicle, const std::string& frame_id = "map");

  /// Throws InputError if the grid over the poses from `first` to `last` would need too much memory, so
  /// that a run fails before it starts. The grid over the cameras' positions is checked before each range map
  /// too.
  void checkGrid(const Trajectory& world_from_vehicle, Timestamp first, Timestamp last) const;

  /// Throws InputError as soon as the grid over the views so far is too large.
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Fuses all range maps; may be called again after more images. `progress` (may be empty) receives the name
  /// of a step and its completed fraction. Throws InputError with numbers and reasons if too many
  /// images had no pose, no range map could be made, the grid is too large, or no cell was observed.
  HeightMapResult finish(const std::function<void(const std::string& step, double fraction)>& progress);

  std::vector<RangeMapperStatus> status() const { return range_mapper_->status(); }
  size_t numViews() const { return views_.size(); }

 private:
  struct View {
    size_t camera_index;
    Timestamp stamp;
    RigidTransform world_from_camera;
    double weight;  ///< grows with the camera's path since its last view
  };
  void addTask(const RangeTask& task);
  void finishSweep();
  void keepRangeMap(const RangeTask& task, const std::string& to);
  RangeMap readView(const View& view) const;
  std::string folder() const;
  void checkCoverage() const;

  const std::shared_ptr<const CameraRig> rig_;
  const HeightMapOptions options_;
  const std::string work_folder_, drive_name_;
  std::string frame_id_ = "odom";
  std::string trajectory_hash_ = "odometry";
  std::unique_ptr<RangeMapper> range_mapper_;
  std::vector<View> views_;
  std::map<size_t, Eigen::Vector3d> last_position_m_;  // position of each camera at its newest view
  std::map<std::string, double> times_s_;
  size_t num_reused_ = 0;
  std::optional<View> swept_;  // the view whose range map sweep_ computes while the next images are read
  std::unique_ptr<tbb::task_group> sweep_ = std::make_unique<tbb::task_group>();
  Eigen::AlignedBox3d extent_m_;  // x and y: camera positions; z: vehicle poses
};

}  // namespace vcharge
