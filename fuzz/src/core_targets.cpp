#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "fuzz_target.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/height_map_file.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_core/sparse_map/map_tile_reader.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace {

constexpr char kTrajectory[] =
    "# time x y z q\n1.0 0 0 0 0 0 0 1\n1.080000001 0.1 -1e-3 0 0 0 0.1 0.99498743710662\n";

constexpr char kBays[] =
    "frame: map\nbays:\n  - {id: 1, row: 0, kind: angled, state: free, corners_m: [[0, 0], [1, 0], [1, 1], "
    "[0, 1]], entry_sigma_m: 0.05, end_sigma_m: 0.4, confidence: 1}\n";

std::string rigText() {
  CameraRig rig = makeAnalyticMap({2, 4}).rig;
  for (RigCamera& camera : rig.cameras) {
    camera.mask = cv::Mat();
    camera.mask_file.clear();
  }
  rig.provenance["program"] = "test";
  return formatCameraRig(rig);
}

std::string sparseMapBytes() {
  return bytesOf("a.vmap", [](const std::string& path) {
    MapIndex index;
    index.writePlaceRows = [](const MapIndex::PutRow& put) { put(5, {1, 2, 3}); };
    writeSparseMap(SparseMap(makeAnalyticMap({4, 12})), MapProvenance(), path, index);
  });
}

void readTiles(const std::string& path) {
  const std::unique_ptr<MapTileReader> reader = MapTileReader::open(path);
  if (reader == nullptr) {
    return;
  }
  reader->readPlaceRow(5);
  for (const auto& [tile, keyframes] : reader->tiles()) {
    reader->readTile(tile);
  }
}

HeightMap smallHeightMap() {
  HeightMap map;
  map.frame_id = "map";
  map.cell_size_m = 0.05;
  map.height_m = cv::Mat(4, 5, CV_32FC1, cv::Scalar(0.25));
  return map;
}

/// Replaces one of the files of a height map.
FuzzTarget heightMapTarget(const std::string& name, const std::string& replaced) {
  return {name,
          [replaced] {
            const ScratchFolder folder;
            writeHeightMap(smallHeightMap(), folder.path() + "/height_map");
            return std::vector<std::string>{readTextFile(folder.path() + "/" + replaced)};
          },
          [replaced](const std::string& bytes) {
            const ScratchFolder folder;
            writeHeightMap(smallHeightMap(), folder.path() + "/height_map");
            folder.write(replaced, bytes);
            readHeightMap(folder.path() + "/height_map.yaml");
          }};
}

}  // namespace

std::vector<FuzzTarget> coreTargets() {
  return {
      {"rig", [] { return std::vector<std::string>{rigText()}; },
       [](const std::string& bytes) {
         const ScratchFolder folder;
         formatCameraRig(parseCameraRig(bytes, "rig.yaml", folder.path()));
       }},
      fileTarget("trajectory", "a.tum", {kTrajectory}, [](const std::string& path) { readTrajectory(path); }),
      fileTarget("sparse_map", "a.vmap", {sparseMapBytes()},
                 [](const std::string& path) { readSparseMap(path)->contentHash(); }),
      fileTarget("map_tiles", "a.vmap", {sparseMapBytes()}, readTiles),
      fileTarget("parking_bays", "bays.yaml", {kBays},
                 [](const std::string& path) { readParkingBays(path); }),
      heightMapTarget("height_map_yaml", "height_map.yaml"),
      heightMapTarget("height_map_tiff", "height_map.tiff"),
  };
}

}  // namespace vcharge
