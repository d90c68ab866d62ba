#include "light/ground_reflection.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Differences are compared in windows of this reach, at every second pixel.
constexpr int kReach_px = 4, kStep_px = 2;
// Ranges of the ground relative to the distance of what it mirrors.
constexpr float kRangeParts[] = {0.0F, 0.05F, 0.1F, 0.15F, 0.2F, 0.25F, 0.33F, 0.4F, 0.5F};
// What is mirrored stands if its own difference is below this part of what the mirrored differs, in squares.
constexpr float kMoving = 0.5F;
// Refractive index of water, least part of the light that it mirrors, and largest factor of that part.
constexpr float kWater = 1.33F, kLeastMirror = 0.03F, kLargestFactor = 2.0F;

/// Part of the light that water mirrors to where a ray comes from.
float mirroredPart(const Eigen::Vector3f& ray) {
  const float cosine = -ray.z() / ray.norm();
  const float refracted = std::sqrt(1.0F - (1.0F - cosine * cosine) / (kWater * kWater));
  const float across = (cosine - kWater * refracted) / (cosine + kWater * refracted);
  const float along = (refracted - kWater * cosine) / (refracted + kWater * cosine);
  return std::max(kLeastMirror, 0.5F * (across * across + along * along));
}

/// Values of the rows of an image with a border of zeros, which windows may reach.
cv::Mat bordered(const cv::Mat& values) {
  cv::Mat result;
  cv::copyMakeBorder(values, result, kReach_px, kReach_px, kReach_px, kReach_px, cv::BORDER_CONSTANT);
  return result;
}

/// Pixels, by their index in images with and without a border.
struct AskedPixel {
  int inside, bordered;
  float squares, least_unexplained;
};

struct WindowSums {
  float products = 0.0F, squares = 0.0F;
};

/// Sums of a * b and b * b around a pixel of images with a border.
WindowSums sumsAround(const cv::Mat& a, const cv::Mat& b, int pixel) {
  WindowSums sums;
  for (int y = -kReach_px; y <= kReach_px; y += kStep_px) {
    const float* of_a = a.ptr<float>() + pixel + y * a.cols;
    const float* of_b = b.ptr<float>() + pixel + y * b.cols;
    for (int x = -kReach_px; x <= kReach_px; x += kStep_px) {
      sums.products += of_a[x] * of_b[x];
      sums.squares += of_b[x] * of_b[x];
    }
  }
  return sums;
}

/// Rays from a camera to ground that mirrors something, in level axes.
struct MirrorRays {
  void add(int32_t pixel, const Eigen::Vector3f& to_ground, float relative_range) {
    rays.add(pixel, to_ground.x(), to_ground.y(), 0.0F, 1.0F);
    fall.push_back(-to_ground.z());
    part.push_back(mirroredPart(to_ground));
    relative.push_back(relative_range);
  }
  /// Turns the rays to what the ground mirrors.
  void mirror(float range_part) {
    for (size_t i = 0; i < fall.size(); ++i) {
      rays.z[i] = (1.0F - 2.0F * std::min(1.0F, range_part * relative[i])) * fall[i];
    }
  }

  PixelPoints rays;
  std::vector<float> fall;
  std::vector<float> part;      // of the light that is mirrored
  std::vector<float> relative;  // range of the ground, relative to that from the newer camera
};

}  // namespace

cv::Mat unexplainedByReflection(const PointWarp& warp, const LevelView& now, const LevelView& before,
                                const ComparedGround& ground, const cv::Mat& asked) {
  const cv::Rect& rows = ground.rows;
  const int first_pixel = rows.y * rows.width, wide = rows.width + 2 * kReach_px;
  const auto inBorder = [&](int pixel) {
    return (pixel / rows.width + kReach_px) * wide + pixel % rows.width + kReach_px;
  };
  cv::Mat is_near;
  cv::dilate(asked, is_near, cv::Mat::ones(2 * kReach_px + 1, 2 * kReach_px + 1, CV_8U));
  const cv::Mat difference = bordered(ground.difference);
  const Eigen::Matrix3f rotation = ground.level_from_points.rotationMatrix().cast<float>();
  const Eigen::Vector3f from_before =
      (now.level_from_camera.translation() - before.level_from_camera.translation()).cast<float>();
  MirrorRays here, there;
  std::vector<AskedPixel> pixels;
  const PixelPoints& points = ground.points;
  for (size_t i = 0; i < points.size(); ++i) {
    const int at = points.pixel[i] - first_pixel;
    if (is_near.data[at] != 0) {
      const Eigen::Vector3f ray =
          rotation * Eigen::Vector3f(points.x[i], points.y[i], points.z[i]) / points.inverse_range_per_m[i];
      const Eigen::Vector3f ray_before = from_before + ray;
      here.add(points.pixel[i], ray, 1.0F);
      there.add(points.pixel[i], ray_before, ray_before.head<2>().norm() / ray.head<2>().norm());
      if (asked.data[at] != 0) {
        const int in_border = inBorder(at);
        pixels.push_back({at, in_border, sumsAround(difference, difference, in_border).squares, 1.0F});
      }
    }
  }
  const auto lookUp = [&](const LevelView& view, const PixelPoints& rays, float inverse_range,
                          WarpedImage* seen) {
    warp.warpAgain(view.image, view.level_from_camera.inverse(), now.level_from_camera.translation(), rays,
                   inverse_range, rows, seen);
  };
  WarpedImage mirrored = unknownImage(rows.size()), mirrored_before = unknownImage(rows.size()),
              itself_before = unknownImage(rows.size());
  cv::Mat change = cv::Mat::zeros(difference.size(), CV_32FC1), motion = change.clone();
  for (const float part : kRangeParts) {
    here.mirror(part);
    there.mirror(part);
    lookUp(now, here.rays, 0.0F, &mirrored);
    lookUp(before, there.rays, 0.0F, &mirrored_before);
    // What is mirrored stands: it does not differ from itself before.
    lookUp(before, here.rays, part, &itself_before);
    for (size_t i = 0; i < here.part.size(); ++i) {
      const int at = here.rays.pixel[i] - first_pixel, in_border = inBorder(at);
      const bool is_known = mirrored.known.data[at] != 0 && mirrored_before.known.data[at] != 0 &&
                            itself_before.known.data[at] != 0;
      const auto differenceFrom = [&](const WarpedImage& older, float older_part) {
        return is_known ? here.part[i] * static_cast<float>(mirrored.image.data[at]) -
                              older_part * ground.gain * static_cast<float>(older.image.data[at])
                        : 0.0F;
      };
      change.ptr<float>()[in_border] = differenceFrom(mirrored_before, there.part[i]);
      motion.ptr<float>()[in_border] = differenceFrom(itself_before, here.part[i]);
    }
    for (AskedPixel& pixel : pixels) {
      const WindowSums sums = sumsAround(difference, change, pixel.bordered);
      if (sumsAround(motion, motion, pixel.bordered).squares > kMoving * sums.squares) {
        continue;
      }
      const float factor = std::clamp(sums.products / std::max(1.0F, sums.squares), 0.0F, kLargestFactor);
      const float left = pixel.squares - factor * (2.0F * sums.products - factor * sums.squares);
      pixel.least_unexplained = std::min(pixel.least_unexplained, left / std::max(1.0F, pixel.squares));
    }
  }
  cv::Mat result(rows.size(), CV_32FC1, cv::Scalar(1.0));
  for (const AskedPixel& pixel : pixels) {
    result.ptr<float>()[pixel.inside] = pixel.least_unexplained;
  }
  return result;
}

}  // namespace vcharge
