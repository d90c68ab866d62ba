#include "reference/plain_plane_sweep.h"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "reference/real_images.h"
#include "vcharge_core/camera/working_camera.h"

namespace vcharge {
namespace {

/// Undistorts like the authors: reads wrap around at the borders, and gray levels are truncated to 8 bits.
cv::Mat undistortAsTheAuthors(const CameraModel& sensor, const WorkingCamera& working,
                              const cv::Mat& pixels) {
  const auto at = [&](int x, int y) {
    return static_cast<double>(
        pixels.at<uint8_t>((y + pixels.rows) % pixels.rows, (x + pixels.cols) % pixels.cols));
  };
  cv::Mat undistorted(working.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < undistorted.rows; ++y) {
    for (int x = 0; x < undistorted.cols; ++x) {
      Eigen::Vector3d ray;
      Eigen::Vector2d pixel;
      if (working.model().unproject(Eigen::Vector2d(x, y), &ray) && sensor.project(ray, &pixel)) {
        const int u = static_cast<int>(std::floor(pixel.x()));
        const int v = static_cast<int>(std::floor(pixel.y()));
        const double a = pixel.x() - u;
        const double b = pixel.y() - v;
        undistorted.at<uint8_t>(y, x) =
            static_cast<uint8_t>((1 - b) * ((1 - a) * at(u, v) + a * at(u + 1, v)) +
                                 b * ((1 - a) * at(u, v + 1) + a * at(u + 1, v + 1)));
      }
    }
  }
  return undistorted;
}

/// Fraction of all pixels whose plane is within one of the authors' 255 steps of their plane.
double agreementWithTheAuthors(const RealImages& images, Aggregation aggregation,
                               const std::string& index_file) {
  const WorkingCamera working(images.camera, cv::Size(1280, 800), 6.283185307179586, cv::Mat());
  PlaneSweepOptions options;
  options.num_ground_planes = 0;
  options.min_distance_m = 0.4;
  options.max_distance_m = 5000.0;
  options.num_planes = 256;
  options.min_texture = 0.0;
  options.aggregation = aggregation;
  SweepImage reference;
  std::vector<SweepImage> neighbours;
  for (size_t i = 0; i < 5; ++i) {
    const SweepImage image{images.stamps[i], undistortAsTheAuthors(images.camera, working, images.pixels[i]),
                           images.world_from_camera[i]};
    if (i == 2) {
      reference = image;
    } else {
      neighbours.push_back(image);
    }
  }
  const cv::Mat all_valid(working.size(), CV_8UC1, cv::Scalar(255));
  const PlainResult result =
      plainPlaneSweep(working.model(), all_valid, makePlaneFamilies(options, std::nullopt), options,
                      reference, neighbours, PlainBorder::kAsTheAuthors);
  const cv::Mat index = cv::imread(images.folder + "/reference/" + index_file, cv::IMREAD_UNCHANGED);
  EXPECT_EQ(index.size(), working.size()) << index_file;
  int agree = 0;
  for (int y = 0; y < index.rows; ++y) {
    for (int x = 0; x < index.cols; ++x) {
      const double steps =
          (result.inverse_distance.at<double>(y, x) - 1.0 / 5000.0) / (2.5 - 1.0 / 5000.0) * 255.0;
      agree += std::abs(std::round(steps) - index.at<uint8_t>(y, x)) <= 1.0 ? 1 : 0;
    }
  }
  const double fraction = static_cast<double>(agree) / index.size().area();
  std::printf("%s: within 1 of 255 steps on %.4f of all pixels\n", index_file.c_str(), fraction);
  return fraction;
}

TEST(PlainPlaneSweepTest, EqualsTheAuthorsResultWithoutOcclusionHandling) {
  const auto images = readRealImages();
  if (!images) {
    GTEST_SKIP() << "VCHARGE_DATA is not set: needs the real images";
  }
  EXPECT_GE(agreementWithTheAuthors(*images, Aggregation::kMean, "ZNCC_NoOcclusionHandling_index.png"), 0.98);
}

TEST(PlainPlaneSweepTest, EqualsTheAuthorsResultWithReferenceSplit) {
  const auto images = readRealImages();
  if (!images) {
    GTEST_SKIP() << "VCHARGE_DATA is not set: needs the real images";
  }
  EXPECT_GE(agreementWithTheAuthors(*images, Aggregation::kReferenceSplit, "ZNCC_RefSplit_index.png"), 0.975);
}

}  // namespace
}  // namespace vcharge
