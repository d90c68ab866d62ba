#include <sstream>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "fuzz_target.h"
#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_calibration/intrinsics/intrinsics_files.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"
#include "vcharge_camera_driver/driver_options.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_dense/height_map_options.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_localization/drive_localizer.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_obstacles/obstacle_mapper.h"

namespace vcharge {
namespace {

CameraRig smallRig() {
  return makeAnalyticMap({2, 4}).rig;
}

std::string cameraFile(IntrinsicsFormat format) {
  CameraRig rig = smallRig();
  rig.cameras.erase(rig.cameras.begin() + 1, rig.cameras.end());
  rig.cameras[0].mask = cv::Mat();
  return bytesOf("cameras.yaml", [&](const std::string& path) { writeIntrinsics(rig, format, path); });
}

template <class Options>
std::string textOf(const Options& options) {
  std::ostringstream text;
  text << writeFields(options);
  return text.str();
}

template <class Options>
FuzzTarget optionsTarget(const std::string& name, const std::string& seed = textOf(Options())) {
  return fileTarget("options_" + name, "options.yaml", {seed}, [](const std::string& path) {
    Options options;
    readFieldsFromFile(path, &options);
    options.validate();
  });
}

}  // namespace

std::vector<FuzzTarget> stageTargets() {
  return {
      fileTarget("intrinsics", "cameras.yaml",
                 {cameraFile(IntrinsicsFormat::kRig), cameraFile(IntrinsicsFormat::kKalibr),
                  cameraFile(IntrinsicsFormat::kCamodocal)},
                 [](const std::string& path) { formatCameraRig(readIntrinsics(path, 3.0)); }),
      fileTarget("board", "target.yaml",
                 {"target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n",
                  "target_type: checkerboard\ntargetCols: 9\ntargetRows: 6\nrowSpacingMeters: "
                  "0.1\ncolSpacingMeters: 0.1\n"},
                 [](const std::string& path) { readCalibrationBoard(path); }),
      optionsTarget<DriverOptions>("driver", readTextFile(VCHARGE_EXAMPLE_CAR)),
      optionsTarget<RigCalibratorOptions>("calibration"),
      optionsTarget<SparseMapperOptions>("mapping"),
      optionsTarget<DriveLocalizerOptions>("localization"),
      optionsTarget<RangeMapperOptions>("dense"),
      optionsTarget<HeightMapOptions>("height_map"),
      optionsTarget<ObstacleMapperOptions>("obstacles"),
  };
}

}  // namespace vcharge
