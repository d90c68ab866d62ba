#include "reference/real_images.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "reference/plain_plane_sweep.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {
namespace {

const cv::Size kSize(640, 400);
constexpr double kWholeSphere_rad = 6.283185307179586;
constexpr double kAuthorsNear_m = 0.4;
constexpr double kAuthorsFar_m = 5000.0;

/// Options with the authors' planes, which are so close together that no second sweep is needed.
PlaneSweepOptions authorsPlanes() {
  PlaneSweepOptions options;
  options.num_ground_planes = 0;
  options.min_distance_m = kAuthorsNear_m;
  options.max_distance_m = kAuthorsFar_m;
  options.num_planes = 256;
  options.num_refinement_steps = 0;
  return options;
}

class RealImagesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto images = readRealImages();
    if (!images) {
      GTEST_SKIP() << "VCHARGE_DATA is not set: needs the real images";
    }
    images_ = std::make_unique<RealImages>(*images);
    working_ =
        std::make_unique<WorkingCamera>(images_->camera, cv::Size(1280, 800), kWholeSphere_rad, cv::Mat());
    ASSERT_EQ(working_->size(), kSize);
  }

  /// Loads frames 0 to 4 with frame 2 as the reference, as for the authors' results.
  void load(SweepImage* reference, std::vector<SweepImage>* neighbours) const {
    for (size_t i = 0; i < 5; ++i) {
      const SweepImage image{images_->stamps[i], working_->undistort(images_->pixels[i]),
                             images_->world_from_camera[i]};
      if (i == 2) {
        *reference = image;
      } else {
        neighbours->push_back(image);
      }
    }
  }

  RangeMap sweep(const PlaneSweepOptions& options, SweepDetails* details = nullptr) const {
    SweepImage reference;
    std::vector<SweepImage> neighbours;
    load(&reference, &neighbours);
    const PlaneSweep plane_sweep(working_->model(), working_->validMask(), options,
                                 images_->groundInCamera());
    return plane_sweep.sweep(reference, neighbours, details);
  }

  cv::Mat read(const std::string& name) const {
    const cv::Mat image = cv::imread(images_->folder + "/" + name, cv::IMREAD_UNCHANGED);
    EXPECT_EQ(image.size(), kSize) << name;
    return image;
  }

  /// Fraction of the pixels of ground_mask.png whose inverse depth is within 0.02 1/m of the ground's.
  double fractionOnGround(const RangeMap& map) const {
    const cv::Mat mask = read("ground_mask.png");
    const Plane ground = images_->groundInCamera();
    const RayTable rays(working_->model(), kSize, kWholeSphere_rad);
    int all = 0, right = 0;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        if (mask.at<uint8_t>(y, x) == 0) {
          continue;
        }
        const Eigen::Vector3d ray = rays.ray(x, y).cast<double>();
        const double expected = -ground.normal.dot(ray) / ground.distance_m / ray.z();
        const double measured = 1.0 / (map.range_m.at<float>(y, x) * ray.z());
        ++all;
        right += std::abs(measured - expected) <= 0.02 ? 1 : 0;
      }
    }
    return static_cast<double>(right) / all;
  }

  std::unique_ptr<RealImages> images_;
  std::unique_ptr<WorkingCamera> working_;
};

TEST_F(RealImagesTest, KernelAgreesWithTheAuthorsWhereWindowsCorrelate) {
  SweepDetails details;
  const RangeMap map = sweep(authorsPlanes(), &details);
  const cv::Mat index = read("reference/ZNCC_NoOcclusionHandling_index.png");
  const RayTable rays(working_->model(), kSize, kWholeSphere_rad);
  int all = 0, agree = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const float score = details.score.at<float>(y, x);
      // Counts only known pixels whose cost 1 - ZNCC is below 0.2.
      if (!(score > 0.8f) || std::isnan(map.range_m.at<float>(y, x))) {
        continue;
      }
      const double inverse_depth = 1.0 / (map.range_m.at<float>(y, x) * rays.ray(x, y).z());
      const double steps =
          (inverse_depth - 1.0 / kAuthorsFar_m) / (1.0 / kAuthorsNear_m - 1.0 / kAuthorsFar_m) * 255.0;
      ++all;
      agree += std::abs(std::round(steps) - index.at<uint8_t>(y, x)) <= 1.0 ? 1 : 0;
    }
  }
  std::printf("agreement %.4f of %d pixels with cost < 0.2\n", static_cast<double>(agree) / all, all);
  EXPECT_GT(all, kSize.area() / 2);
  EXPECT_GE(agree, 0.97 * all);
}

TEST_F(RealImagesTest, CobblesLieOnTheGround) {
  PlaneSweepOptions options;
  for (const Aggregation aggregation : {Aggregation::kMean, Aggregation::kReferenceSplit}) {
    options.aggregation = aggregation;
    const double fraction = fractionOnGround(sweep(options));
    std::printf("on the ground, aggregation %d: %.4f\n", static_cast<int>(aggregation), fraction);
    EXPECT_GE(fraction, 0.94);
  }
}

}  // namespace
}  // namespace vcharge
