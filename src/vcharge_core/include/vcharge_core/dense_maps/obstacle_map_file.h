#pragma once

#include <string>
#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"

namespace vcharge {

/// One image stamp's obstacles on disk, in FOLDER:
///   <stamp_ns>.pgm, .yaml     grid of map_server (trinary): 0 occupied, 254 free, 205 unobserved, row 0 on
///                             top; the YAML has further keys (frame, pose, stamp), which map_server ignores
///   <stamp_ns>_{x,y,point_sigma,height,height_sigma,age}.tiff   CV_32FC1, rows as in ObstacleMap
///   <stamp_ns>_scans.csv      all scans: name, origin, angle, range, free range, sigma, height
/// The YAML is written last: where it exists the stamp is complete.
void writeObstacles(const ObstacleMap& map, const std::vector<ObstacleScan>& scans,
                    const std::string& folder);

/// Stamps in a folder, ascending. InputError when there is no such folder.
std::vector<Timestamp> listObstacles(const std::string& folder);

/// Throws InputError naming the file that is missing, malformed or has a different size.
ObstacleMap readObstacleMap(const std::string& folder, Timestamp stamp);
std::vector<ObstacleScan> readObstacleScans(const std::string& folder, Timestamp stamp);

/// Writes only the occupancy grid in the format of map_server: PATH_STEM.pgm and PATH_STEM.yaml.
void writeOccupancyGrid(const ObstacleMap& map, const std::string& path_stem);

}  // namespace vcharge
