#include "rendering/reprojection.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/sensors/camera_response.h"

namespace vcharge {

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
const double kMinIncidenceCosine = std::cos(75.0 * kDegree);
const double kMinAxisCosine = std::cos(85.0 * kDegree);  // the image fades at the rim, from 89 degrees on
constexpr double kMinResolution = 0.8;
constexpr double kMaxRangeError = 0.03;  // relative to the range
constexpr double kMaxRelief_px = 0.25;   // pixels of `first`
constexpr int kSamples = 4;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Compares the pixels of one picture with another picture.
class Comparison {
 public:
  Comparison(const Picture& first, const Picture& second)
      : first_(first),
        second_(second),
        second_from_first_(second.world_from_camera.inverse() * first.world_from_camera) {}

  // Mean gray of `second` over the surface patch seen by a pixel of `first` (not on its border).
  std::optional<double> grayOfSecond(int x, int y) const {
    const Eigen::Vector3d here = point(x, y);
    const Eigen::Vector3d normal =
        (point(x + 1, y) - point(x - 1, y)).cross(point(x, y + 1) - point(x, y - 1)).normalized();
    const Eigen::Vector3d there = second_from_first_ * here;
    const Eigen::Vector3d normal_there = second_from_first_.rotation() * normal;
    // Also false where a range is missing.
    const bool faces_both = std::abs(normal.dot(here.normalized())) > kMinIncidenceCosine &&
                            std::abs(normal_there.dot(there.normalized())) > kMinIncidenceCosine &&
                            here.z() > kMinAxisCosine * here.norm() &&
                            there.z() > kMinAxisCosine * there.norm();
    Eigen::Vector2d pixel;
    if (!faces_both || !second_.camera.project(there, &pixel)) {
      return std::nullopt;
    }
    const std::optional<Eigen::Matrix2d> footprint = findFootprint(x, y, pixel);
    // A view that is coarser in any direction cannot reproduce a finer one; a finer one is averaged.
    if (!footprint || Eigen::JacobiSVD<Eigen::Matrix2d>(*footprint).singularValues().y() < kMinResolution) {
      return std::nullopt;
    }
    double gray = 0.0;
    for (int k = 0; k < kSamples * kSamples; ++k) {
      const Eigen::Vector2d sample(k % kSamples, k / kSamples);  // NOLINT: whole column and row
      const Eigen::Vector2d offset = (sample.array() + 0.5) / kSamples - 0.5;
      const std::optional<double> value = interpolate(pixel + *footprint * offset, there.norm());
      if (!value) {
        return std::nullopt;
      }
      gray += *value / (kSamples * kSamples);
    }
    return gray;
  }

 private:
  Eigen::Vector3d point(int x, int y) const {
    return first_.points[static_cast<size_t>(y) * first_.gray.cols + x].cast<double>();
  }

  // Jacobian from pixels of `first` to pixels of `second`, if the neighbours belong to the same surface.
  std::optional<Eigen::Matrix2d> findFootprint(int x, int y, const Eigen::Vector2d& pixel) const {
    Eigen::Matrix<double, 2, 9> around;
    for (int k = 0; k < 9; ++k) {
      Eigen::Vector2d at;
      const Eigen::Vector3d neighbour = point(x + k % 3 - 1, y + k / 3 - 1);
      if (!neighbour.allFinite() || !second_.camera.project(second_from_first_ * neighbour, &at)) {
        return std::nullopt;
      }
      around.col(k) = at;
    }
    Eigen::Matrix2d footprint;
    footprint << 0.5 * (around.col(5) - around.col(3)), 0.5 * (around.col(7) - around.col(1));
    const Eigen::Matrix2d first_from_second = footprint.inverse();
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector2d step(k % 3 - 1, k / 3 - 1);  // NOLINT: whole column and row
      if (!((first_from_second * (around.col(k) - pixel) - step).norm() < kMaxRelief_px)) {
        return std::nullopt;
      }
    }
    return footprint;
  }

  // Bilinear interpolation in `second`, if all four pixels see the surface at `range_m`.
  std::optional<double> interpolate(const Eigen::Vector2d& at, double range_m) const {
    const int column = static_cast<int>(std::floor(at.x()));
    const int row = static_cast<int>(std::floor(at.y()));
    if (column < 0 || row < 0 || column + 1 >= second_.gray.cols || row + 1 >= second_.gray.rows) {
      return std::nullopt;
    }
    double gray = 0.0;
    for (int k = 0; k < 4; ++k) {
      const int x = column + k % 2;
      const int y = row + k / 2;
      if (!(std::abs(second_.range_m.at<float>(y, x) - range_m) < kMaxRangeError * range_m)) {
        return std::nullopt;
      }
      gray += (1.0 - std::abs(at.x() - x)) * (1.0 - std::abs(at.y() - y)) * second_.gray.at<uint8_t>(y, x);
    }
    return gray;
  }

  const Picture& first_;
  const Picture& second_;
  const RigidTransform second_from_first_;
};

bool showsCar(const Renderer& renderer, const Picture& picture, int x, int y) {
  const Eigen::Vector3d point =
      picture.points[static_cast<size_t>(y) * picture.gray.cols + x].cast<double>().normalized();
  SurfaceKind kind = SurfaceKind::kOther;
  return renderer.castRay(picture.world_from_camera.translation(),
                          picture.world_from_camera.rotation() * point, 0.0, &kind) &&
         kind == SurfaceKind::kCar;
}

}  // namespace

Picture takePicture(const Renderer& renderer, const CameraView& view,
                    const RigidTransform& world_from_vehicle, double time_s) {
  check(view.lens().veil == 0.0, "takePicture: expected a lens without veil");
  // The vignette is removed, since a surface passes different parts of the two lenses.
  cv::Mat flat;
  cv::divide(renderer.renderLight(view, world_from_vehicle, time_s), cv::max(view.vignette(), 0.05), flat);
  Picture picture{CameraResponse().develop(flat),
                  renderer.renderRange(view, world_from_vehicle, time_s),
                  {},
                  view.camera().model,
                  world_from_vehicle * *view.camera().vehicle_from_camera};
  picture.points.reserve(static_cast<size_t>(view.size().area()));
  for (int y = 0; y < view.size().height; ++y) {
    for (int x = 0; x < view.size().width; ++x) {
      picture.points.push_back(view.centreRay(x, y) * picture.range_m.at<float>(y, x));
    }
  }
  return picture;
}

std::string toString(const Reprojection& result) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << result.mean_difference << " gray levels (single pixels "
       << result.mean_pixel_difference << "), shift " << std::setprecision(3) << result.shift_px.norm()
       << " pixels, " << result.count << " means";
  return text.str();
}

Reprojection reproject(const Renderer& renderer, const Picture& first, const Picture& second,
                       Surfaces surfaces) {
  const Comparison comparison(first, second);
  const cv::Size size = first.gray.size();
  cv::Mat moved(size, CV_32FC1, cv::Scalar(kNaN));  // `second` as seen from `first`
  tbb::parallel_for(1, std::max(1, size.height - 1), [&](int y) {
    for (int x = 1; x + 1 < size.width; ++x) {
      const std::optional<double> gray = comparison.grayOfSecond(x, y);
      if (gray && (surfaces == Surfaces::kAll || !showsCar(renderer, first, x, y))) {
        moved.at<float>(y, x) = static_cast<float>(*gray);
      }
    }
  });
  Reprojection result;
  // Normal equations of the fit difference = gradient * shift + brightness.
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (int y = 1; y + 1 < size.height; ++y) {
    for (int x = 1; x + 1 < size.width; ++x) {
      double difference = 0.0;
      Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  // gradient of the mean of both images
      for (int k = 0; k < 9; ++k) {
        const Eigen::Vector2d step(k % 3 - 1, k / 3 - 1);  // NOLINT: whole column and row
        const double one = first.gray.at<uint8_t>(y + k / 3 - 1, x + k % 3 - 1);
        const double other = moved.at<float>(y + k / 3 - 1, x + k % 3 - 1);
        difference += (other - one) / 9.0;
        gradient += step * (0.5 * (one + other) / 6.0);
      }
      if (std::isnan(difference)) {
        continue;
      }
      ++result.count;
      result.mean_difference += std::abs(difference);
      result.mean_pixel_difference += std::abs(moved.at<float>(y, x) - first.gray.at<uint8_t>(y, x));
      const Eigen::Vector3d row(gradient.x(), gradient.y(), 1.0);
      normal_matrix += row * row.transpose();
      right_side += row * difference;
    }
  }
  if (result.count > 0) {
    result.mean_difference /= result.count;
    result.mean_pixel_difference /= result.count;
    result.shift_px = normal_matrix.ldlt().solve(right_side).head<2>();
  }
  return result;
}

}  // namespace vcharge
