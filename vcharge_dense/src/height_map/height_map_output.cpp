#include "vcharge_dense/height_map_output.h"

#include <cmath>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_core/dense_maps/height_map_file.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr double kPictureSpan_m = 1.8;  // heights that the colours span, from slightly below the ground

void writePicture(const cv::Mat& picture, const std::string& path) {
  if (!cv::imwrite(path, picture)) {
    throw InputError(path + ": cannot be written (is the disk full?)");
  }
}

double lowGround(const cv::Mat& height_m) {
  std::vector<double> heights;
  for (int row = 0; row < height_m.rows; ++row) {
    for (int column = 0; column < height_m.cols; ++column) {
      const float height = height_m.at<float>(row, column);
      if (std::isfinite(height)) {
        heights.push_back(height);
      }
    }
  }
  return heights.empty() ? 0.0 : quantile(std::move(heights), 0.05);
}

}  // namespace

void writeHeightMapFolder(HeightMapResult* result, const std::string& folder) {
  FolderTransaction transaction(folder);
  const std::string& path = transaction.path();
  writeHeightMap(result->map, path + "/height_map");
  writeOccupancyMap(result->map, result->states, path + "/drivable");
  writeHeightMapMesh(result->map, path + "/mesh.ply");
  result->octomap->write(path + "/octomap.bt");
  const double low_m = lowGround(result->map.height_m) - 0.2;
  writePicture(colourHeight(result->map, low_m, low_m + kPictureSpan_m), path + "/height_map.png");
  transaction.commit();
}

}  // namespace vcharge
