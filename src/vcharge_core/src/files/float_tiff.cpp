#include "files/float_tiff.h"

#include <filesystem>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

void writeFloatTiff(const cv::Mat& image, const std::string& path) {
  writeFileAtomically(path, [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, image)) {
      throw InputError(path + ": cannot be written");
    }
  });
}

cv::Mat readFloatTiff(const std::string& path) {
  cv::Mat image = std::filesystem::is_regular_file(path) ? cv::imread(path, cv::IMREAD_UNCHANGED) : cv::Mat();
  if (image.empty() || image.type() != CV_32FC1) {
    throw InputError(path + ": expected a TIFF of 32-bit floats");
  }
  return image;
}

}  // namespace vcharge
