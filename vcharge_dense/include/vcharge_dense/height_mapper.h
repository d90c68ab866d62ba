#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_dense/height_map_options.h"
#include "vcharge_dense/octomap_builder.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {

/// How the two passes converged, and what went in.
struct HeightMapStatistics {
  size_t num_views = 0;     ///< range maps that were fused
  size_t num_reused = 0;    ///< of these, taken from an earlier run
  size_t num_observed = 0;  ///< cells
  size_t num_solid = 0;     ///< cells without a height where something stands
  int label_iterations = 0, height_iterations = 0;
  double label_gap_per_cell = 0.0, height_gap_per_cell = 0.0;
  bool converged = false;                 ///< both passes, within max_iterations
  std::map<std::string, double> times_s;  ///< wall time by stage
};

struct HeightMapResult {
  HeightMap map;
  cv::Mat states;  ///< CV_8UC1 of CellState
  std::unique_ptr<OctomapBuilder> octomap;
  HeightMapStatistics statistics;
};

/// A drive becomes a height map: range maps on the way, kept in a folder so that no drive is too long and a
/// run that was stopped goes on where it was, and their fusion at the end (paper, section Height Map Fusion).
/// The one stage of build_height_map and height_map_nodelet. Not thread safe.
class HeightMapper : public DriveConsumer {
 public:
  /// `work_folder` holds the range maps; those of the same drive, rig, poses and options are taken from it
  /// (`drive_name` tells drives apart, e.g. the bag's hash; empty: nothing is taken). InputError as
  /// RangeMapper's; std::invalid_argument for bad options.
  HeightMapper(std::shared_ptr<const CameraRig> rig, const HeightMapOptions& options, std::string work_folder,
               const std::string& drive_name);
  ~HeightMapper() override;

  /// Poses in place of odometry's; the map is then in the frame `frame_id`, else in "odom".
  void setTrajectory(const Trajectory& map_from_vehicle, const std::string& frame_id = "map");

  /// Whether the grid over these poses fits into memory, told before any work: those of the drive's time,
  /// from `first` to `last`. The grid of the cameras' positions is checked before each range map, too.
  /// InputError with the numbers where it does not fit.
  void checkGrid(const Trajectory& world_from_vehicle, Timestamp first, Timestamp last) const;

  /// InputError as soon as the grid over the views so far is too large.
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Fuses what was seen. May be called again, after more images. `progress` (may be empty) takes the name of
  /// a step and the share of it that is done. InputError when too many images had no pose, no range map could
  /// be made, the grid is too large, or no cell was observed; texts name numbers and reasons.
  HeightMapResult finish(const std::function<void(const std::string& step, double share)>& progress);

  std::vector<RangeMapperStatus> status() const { return range_mapper_->status(); }
  size_t numViews() const { return views_.size(); }

 private:
  struct View {
    size_t camera_index;
    Timestamp stamp;
    RigidTransform world_from_camera;
  };
  void addTask(const RangeTask& task);
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
  std::map<size_t, Eigen::Vector3d> last_position_m_;  // by camera, of its newest view
  std::map<std::string, double> times_s_;
  size_t num_reused_ = 0;
  Eigen::AlignedBox3d extent_m_;  // in x and y of the views, in z of the vehicle's poses
};

}  // namespace vcharge
