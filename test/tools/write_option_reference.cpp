/// Prints doc/options.md: every option of the suite, from its declaration.
///
///   rosrun vcharge_tests write_option_reference > doc/options.md

#include <iostream>
#include <map>
#include <string>

#include "vcharge_calibration/from_map/map_rig_calibrator_options.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_calibration/intrinsics/view_collector.h"
#include "vcharge_calibration/live/rig_calibration_session.h"
#include "vcharge_calibration/masks/body_mask_estimator.h"
#include "vcharge_calibration/monitor/rig_monitor.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"
#include "vcharge_camera_driver/driver_options.h"
#include "vcharge_core/base/options.h"
#include "vcharge_dense/height_map_options.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_dense/surround_view.h"
#include "vcharge_localization/drive_localizer.h"
#include "vcharge_mapping/map_summary.h"
#include "vcharge_mapping/map_updater.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_obstacles/object_tracker.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_simulation/drive/drive_scenario.h"

namespace {

std::map<std::string, std::string> listed_groups;

template <class Options>
void writeSection(const std::string& title, const std::string& used_by) {
  std::cout << "\n## " << title << "\n\n"
            << used_by << "\n\n"
            << vcharge::optionTable(Options(), title, &listed_groups);
}

}  // namespace

int main() {
  std::cout << "# Options\n\n"
               "A YAML file or a parameter names only what differs from the default; keys with dots are "
               "nested maps.\n`--show-options` of a tool prints its own. Made by `rosrun vcharge_tests "
               "write_option_reference`;\na test compares this page with the declarations.\n";
  writeSection<vcharge::DriverOptions>("Camera driver",
                                       "`camera_driver_nodelet`: `~options`, `config/driver/`.");
  writeSection<vcharge::LiveDriveSourceOptions>("Live topics",
                                                "All nodelets that read images and odometry: `~source`.");
  writeSection<vcharge::IntrinsicCalibrationOptions>(
      "Intrinsic calibration", "`calibrate_intrinsics`, `intrinsic_calibration_nodelet`.");
  writeSection<vcharge::ViewCollectorOptions>("Views of the board, live",
                                              "`intrinsic_calibration_nodelet`: `~collector`.");
  writeSection<vcharge::RigCalibratorOptions>(
      "Extrinsic calibration from a drive",
      "`calibrate_rig`, `calibration_nodelet`: `config/calibration.yaml`.");
  writeSection<vcharge::RigCalibrationSessionOptions>("Extrinsic calibration, live",
                                                      "`calibration_nodelet`: `~session`.");
  writeSection<vcharge::RigMonitorOptions>("Watch over a rig", "`monitor_rig`, `monitor_nodelet`.");
  writeSection<vcharge::MapRigCalibratorOptions>(
      "Extrinsic calibration from a map", "`calibrate_rig_from_map`: `config/calibration_in_map.yaml`.");
  writeSection<vcharge::BodyMaskOptions>("Masks of the own body", "`make_masks`.");
  writeSection<vcharge::SparseMapperOptions>("Sparse map",
                                             "`build_map`, `mapping_nodelet`: `config/mapping.yaml`.");
  writeSection<vcharge::MergeOptions>("Merged map", "`merge_maps`.");
  writeSection<vcharge::UpdateOptions>("Updated map", "`update_map`.");
  writeSection<vcharge::SummaryOptions>("Summary of a map", "`summarize_map`.");
  writeSection<vcharge::DriveLocalizerOptions>(
      "Localization", "`localize_drive`, `localization_nodelet`: `config/localization.yaml`.");
  writeSection<vcharge::RangeMapperOptions>("Range maps",
                                            "`compute_range_maps`, `depth_nodelet`: `config/dense*.yaml`.");
  writeSection<vcharge::HeightMapOptions>(
      "Height map", "`build_height_map`, `height_map_nodelet`: `config/height_map.yaml`.");
  writeSection<vcharge::ObjectTrackerOptions>("Moving objects",
                                              "`object_nodelet`; `detect_obstacles` uses the defaults.");
  writeSection<vcharge::ObstacleMapperOptions>(
      "Obstacle map", "`detect_obstacles`, `obstacle_nodelet`: `config/obstacles.yaml`.");
  writeSection<vcharge::SurroundViewOptions>("Surround view",
                                             "`render_surround_view`, `surround_view_nodelet`.");
  writeSection<vcharge::DriveScenario>("Simulated drive", "`simulate_drive`: `config/scenarios/`.");
  return 0;
}
