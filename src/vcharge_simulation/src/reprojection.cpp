#include "reprojection.h"

#include <cmath>

#include <Eigen/SVD>
#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/camera_response.h"

namespace vcharge {

namespace {

constexpr double kMaxIncidence_rad = 75.0 * 3.14159265358979323846 / 180.0;
constexpr double kMinResolution = 0.8;
constexpr double kMaxRangeStep = 0.05;
constexpr int kSamples = 4;

}  // namespace

Reprojection reproject(const Renderer& renderer, const Sighting& first, const Sighting& second,
                       Surfaces surfaces) {
  const CameraView& from = first.view;
  const CameraView& to = second.view;
  const RigidTransform& world_from_vehicle_1 = first.world_from_vehicle;
  const RigidTransform& world_from_vehicle_2 = second.world_from_vehicle;
  const CameraResponse response;
  const auto develop = [&](const Sighting& sighting) {
    const CameraView& view = sighting.view;
    const cv::Mat light = renderer.renderLight(view, sighting.world_from_vehicle, sighting.time_s);
    cv::Mat flat;
    cv::divide(light, cv::max(view.vignette(), 0.05),
               flat);  // the same surface passes other parts of the lens
    return response.develop(flat);
  };
  const cv::Mat image_1 = develop(first);
  const cv::Mat image_2 = develop(second);
  const cv::Mat range_1 = renderer.renderRange(from, world_from_vehicle_1, first.time_s);
  const cv::Mat range_2 = renderer.renderRange(to, world_from_vehicle_2, second.time_s);
  const RigidTransform world_from_1 = world_from_vehicle_1 * *from.camera().vehicle_from_camera;
  const RigidTransform second_from_first =
      (world_from_vehicle_2 * *to.camera().vehicle_from_camera).inverse() * world_from_1;
  const auto point = [&](int x, int y) {
    return (from.centreRay(x, y) * range_1.at<float>(y, x)).cast<double>().eval();
  };
  Reprojection result;
  for (int y = 1; y + 1 < image_1.rows; ++y) {
    for (int x = 1; x + 1 < image_1.cols; ++x) {
      const Eigen::Vector3d here = point(x, y);
      const Eigen::Vector3d normal =
          (point(x + 1, y) - point(x - 1, y)).cross(point(x, y + 1) - point(x, y - 1)).normalized();
      const double incidence_rad = std::acos(std::min(1.0, std::abs(normal.dot(here.normalized()))));
      if (!(incidence_rad < kMaxIncidence_rad && from.centreRay(x, y).z() > std::cos(kMaxIncidence_rad))) {
        continue;  // also where the range is NaN
      }
      const Eigen::Vector3d there = second_from_first * here;
      const double cos_incidence_there =
          std::abs((second_from_first.rotation() * normal).dot(there.normalized()));
      Eigen::Vector2d pixel;
      if (cos_incidence_there < std::cos(kMaxIncidence_rad) ||
          there.z() < std::cos(kMaxIncidence_rad) * there.norm() ||
          !to.camera().model.project(there, &pixel)) {
        continue;
      }
      const int u = static_cast<int>(std::floor(pixel.x()));
      const int v = static_cast<int>(std::floor(pixel.y()));
      if (u < 0 || v < 0 || u + 1 >= image_2.cols || v + 1 >= image_2.rows) {
        continue;
      }
      // Neither partly hidden in `to`, nor beside an outline in `from`: such a pixel shows two things.
      bool visible = true;
      for (int k = 0; k < 4; ++k) {
        visible =
            visible && std::abs(range_2.at<float>(v + k / 2, u + k % 2) - there.norm()) < 0.03 * there.norm();
      }
      for (int k = 0; k < 9; ++k) {
        visible = visible && std::abs(range_1.at<float>(y + k / 3 - 1, x + k % 3 - 1) - here.norm()) <
                                 kMaxRangeStep * here.norm();
      }
      if (!visible) {
        continue;
      }
      // What one pixel of `from` covers in `to`. A view that is coarser in any direction cannot reproduce a
      // finer one; a finer one is averaged over the coarser one's pixel.
      Eigen::Vector2d right, left, below, above;
      const auto project = [&](int column, int row, Eigen::Vector2d* at) {
        return to.camera().model.project(second_from_first * point(column, row), at);
      };
      if (!project(x + 1, y, &right) || !project(x - 1, y, &left) || !project(x, y + 1, &below) ||
          !project(x, y - 1, &above)) {
        continue;
      }
      Eigen::Matrix2d footprint;
      footprint << 0.5 * (right - left), 0.5 * (below - above);
      if (Eigen::JacobiSVD<Eigen::Matrix2d>(footprint).singularValues().y() < kMinResolution) {
        continue;
      }
      if (surfaces == Surfaces::kNoCars) {
        const Eigen::Vector3d& eye = world_from_1.translation();
        SurfaceKind kind = SurfaceKind::kOther;
        renderer.castRay(eye, (world_from_1 * here - eye).normalized(), 0.0, &kind);
        if (kind == SurfaceKind::kCar) {
          continue;
        }
      }
      double gray = 0.0;
      bool inside = true;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const Eigen::Vector2d sample(k % kSamples, k / kSamples);  // NOLINT: whole column and row
        const Eigen::Vector2d offset = (sample.array() + 0.5) / kSamples - 0.5;
        const Eigen::Vector2d at = pixel + footprint * offset;
        const int column = static_cast<int>(std::floor(at.x()));
        const int row = static_cast<int>(std::floor(at.y()));
        if (column < 0 || row < 0 || column + 1 >= image_2.cols || row + 1 >= image_2.rows) {
          inside = false;
          break;
        }
        const double a = at.x() - column;
        const double b = at.y() - row;
        gray += ((1 - a) * (1 - b) * image_2.at<uint8_t>(row, column) +
                 a * (1 - b) * image_2.at<uint8_t>(row, column + 1) +
                 (1 - a) * b * image_2.at<uint8_t>(row + 1, column) +
                 a * b * image_2.at<uint8_t>(row + 1, column + 1)) /
                (kSamples * kSamples);
      }
      if (!inside) {
        continue;
      }
      result.mean_difference += std::abs(gray - image_1.at<uint8_t>(y, x));
      ++result.count;
    }
  }
  result.mean_difference /= std::max(1, result.count);
  return result;
}

}  // namespace vcharge
