#include "masks/static_structure.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/quantile.h"

namespace vcharge::internal {
namespace {

constexpr int kMaxWidth_px = 640;
// Scales of the smoothed images whose difference is the local contrast.
constexpr double kFine_px = 1.0;
constexpr double kCoarse_px = 3.0;
// Standard deviation of white noise of unit strength in the difference, and in the gradient at the fine
// scale.
constexpr double kContrastNoise = 0.238;
constexpr double kGradientNoise = 0.16;
// Gradients much weaker than this, relative to the brightness, count as no edge.
constexpr double kEdgeContrast = 0.01;
// Gray levels that are added to the brightness, since dark pixels have no reliable contrast.
constexpr double kDark = 6.0;
// Width of the rim of the image circle in which lenses fade to black.
constexpr float kRim_rad = 0.15F;
constexpr int kRimBins = 40;
constexpr int kMinOutside_px = 200;
// Moving structure that is weaker than this fraction of the noise is not significant.
constexpr double kMinMoving = 0.3;
constexpr int kBlock_px = 16;

/// Standard deviation of the noise: the smoothest blocks' response to a filter that cancels planes
/// (Immerkaer, Computer Vision and Image Understanding 1996).
double noiseOf(const SmallView& view, const std::vector<cv::Mat>& images) {
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1) / 6.0F;
  std::vector<double> deviations;
  for (const cv::Mat& image : images) {
    if (image.empty()) {
      continue;
    }
    cv::Mat response;
    cv::filter2D(image, response, CV_32F, kernel);
    for (int y = 0; y + kBlock_px <= image.rows; y += kBlock_px) {
      for (int x = 0; x + kBlock_px <= image.cols; x += kBlock_px) {
        const cv::Rect block(x, y, kBlock_px, kBlock_px);
        const double mean = cv::mean(image(block))[0];
        if (cv::countNonZero(view.valid(block)) == block.area() && mean > 10.0 && mean < 240.0) {
          deviations.push_back(cv::norm(response(block)) / kBlock_px);
        }
      }
    }
  }
  return deviations.empty() ? 1.0 : std::clamp(quantile(deviations, 0.05), 0.3, 8.0);
}

cv::Mat meanOf(const std::vector<cv::Mat>& images, const std::vector<double>& weights, cv::Size size) {
  cv::Mat sum = cv::Mat::zeros(size, CV_32FC1);
  double total = 0.0;
  for (size_t i = 0; i < images.size(); ++i) {
    if (!images[i].empty()) {
      cv::accumulateWeighted(images[i], sum, weights[i] / (total += weights[i]));
    }
  }
  return sum;
}

/// Gray level without light: what the lens scatters to pixels outside the field of view.
double blackOf(const SmallView& view, const cv::Mat& mean) {
  cv::Mat outside;
  cv::erode(view.valid == 0, outside, cv::Mat::ones(9, 9, CV_8U));
  return cv::countNonZero(outside) < kMinOutside_px ? 0.0 : cv::mean(mean, outside)[0];
}

/// Fading of the lens at the rim of the image circle, relative to the inside: the median over all directions
/// from the axis of the ratio to the pixel further inside.
cv::Mat rimFading(const SmallView& view, const cv::Mat& light) {
  double rim_rad = 0.0;
  cv::minMaxLoc(view.angle_rad, nullptr, &rim_rad, nullptr, nullptr, view.valid);
  const float inner_rad = static_cast<float>(rim_rad) - kRim_rad;
  constexpr size_t kDirections = 180;
  std::vector<std::vector<double>> inside(kDirections);
  std::vector<std::vector<double>> cells(kDirections * kRimBins);
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const float beyond = view.angle_rad.at<float>(y, x) - inner_rad;
      if (view.valid.at<uint8_t>(y, x) == 0 || beyond < -0.5F * kRim_rad) {
        continue;
      }
      const size_t direction = view.sectorOf(y, x, kDirections);
      if (beyond < 0.0F) {
        inside[direction].push_back(light.at<float>(y, x));
      } else {
        const int bin = std::min(kRimBins - 1, static_cast<int>(beyond / kRim_rad * kRimBins));
        cells[direction * kRimBins + static_cast<size_t>(bin)].push_back(light.at<float>(y, x));
      }
    }
  }
  std::vector<float> fading(kRimBins, 1.0F);
  for (size_t bin = 0; bin < kRimBins; ++bin) {
    std::vector<double> ratios;
    for (size_t direction = 0; direction < kDirections; ++direction) {
      const std::vector<double>& cell = cells[direction * kRimBins + bin];
      if (!cell.empty() && !inside[direction].empty()) {
        ratios.push_back(quantile(cell, 0.5) / std::max(1.0, quantile(inside[direction], 0.5)));
      }
    }
    if (!ratios.empty()) {
      fading[bin] = static_cast<float>(std::clamp(quantile(ratios, 0.5), 0.02, 1.0));
    }
  }
  cv::Mat result(view.size, CV_32FC1, cv::Scalar(1.0));
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const float at = (view.angle_rad.at<float>(y, x) - inner_rad) / kRim_rad * kRimBins - 0.5F;
      if (at > 0.0F) {
        const int bin = std::min(kRimBins - 1, static_cast<int>(at));
        const float part = std::min(1.0F, at - static_cast<float>(bin));
        const float next = fading[static_cast<size_t>(std::min(kRimBins - 1, bin + 1))];
        result.at<float>(y, x) = fading[static_cast<size_t>(bin)] * (1.0F - part) + next * part;
      }
    }
  }
  return result;
}

/// Removes from the edges what the fading of the rim leaves, which is alike in all directions from the axis.
void removeRimEdge(const SmallView& view, StaticStructure* structure) {
  double rim_rad = 0.0;
  cv::minMaxLoc(view.angle_rad, nullptr, &rim_rad, nullptr, nullptr, view.valid);
  const auto binOf = [&](int y, int x) {
    return static_cast<int>((view.angle_rad.at<float>(y, x) - rim_rad + kRim_rad) / kRim_rad * kRimBins);
  };
  const auto radial = [&](int y, int x) {
    const cv::Point2f ray(static_cast<float>(x) - view.centre.x, static_cast<float>(y) - view.centre.y);
    return ray / std::max(1.0, cv::norm(ray));
  };
  std::vector<std::vector<double>> edges(kRimBins);
  for (const bool measures : {true, false}) {
    for (int y = 0; y < view.size.height; ++y) {
      for (int x = 0; x < view.size.width; ++x) {
        const int bin = std::min(kRimBins - 1, binOf(y, x));
        if (view.valid.at<uint8_t>(y, x) == 0 || bin < 0) {
          continue;
        }
        const cv::Point2f out = radial(y, x);
        float& edge_x = structure->edge_x.at<float>(y, x);
        float& edge_y = structure->edge_y.at<float>(y, x);
        if (measures) {
          edges[static_cast<size_t>(bin)].push_back(edge_x * out.x + edge_y * out.y);
        } else {
          const auto common = static_cast<float>(edges[static_cast<size_t>(bin)].front());
          edge_x -= common * out.x;
          edge_y -= common * out.y;
        }
      }
    }
    for (std::vector<double>& bin : edges) {
      if (measures && !bin.empty()) {
        bin = {quantile(bin, 0.5)};
      }
    }
  }
}

/// Gaussian smoothing that leaves out pixels outside the field of view.
class Smoothing {
 public:
  Smoothing(const cv::Mat& valid, double sigma_px) : sigma_px_(sigma_px) {
    valid.convertTo(valid_, CV_32F, 1.0 / 255.0);
    cv::GaussianBlur(valid_, weight_, cv::Size(), sigma_px_);
    weight_ = cv::max(weight_, 1e-6);
  }
  cv::Mat operator()(const cv::Mat& image) const {
    cv::Mat result;
    cv::GaussianBlur(image.mul(valid_), result, cv::Size(), sigma_px_);
    return result / weight_;
  }

 private:
  const double sigma_px_;
  cv::Mat valid_, weight_;
};

}  // namespace

cv::Size smallSize(const RigCamera& camera) {
  const cv::Size full = camera.image_size_px;
  const double scale = std::min(1.0, static_cast<double>(kMaxWidth_px) / full.width);
  return {cvRound(full.width * scale), std::max(1, cvRound(full.height * scale))};
}

SmallView makeSmallView(const RigCamera& camera) {
  SmallView view;
  const cv::Size full = camera.image_size_px;
  view.size = smallSize(camera);
  Eigen::Vector2d axis(0.5 * full.width, 0.5 * full.height);
  camera.model.project(Eigen::Vector3d::UnitZ(), &axis);
  view.centre = cv::Point2f(static_cast<float>((axis.x() + 0.5) * view.size.width / full.width - 0.5),
                            static_cast<float>((axis.y() + 0.5) * view.size.height / full.height - 0.5));
  view.valid = cv::Mat::zeros(view.size, CV_8UC1);
  view.rays = cv::Mat::zeros(view.size, CV_32FC3);
  view.angle_rad = cv::Mat(view.size, CV_32FC1, cv::Scalar(10.0));
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const Eigen::Vector2d pixel((x + 0.5) * full.width / view.size.width - 0.5,
                                  (y + 0.5) * full.height / view.size.height - 0.5);
      Eigen::Vector3d ray;
      if (camera.model.unproject(pixel, &ray)) {
        const double angle_rad = std::atan2(ray.head<2>().norm(), ray.z());
        const Eigen::Vector3f direction = ray.normalized().cast<float>();
        view.rays.at<cv::Vec3f>(y, x) = {direction.x(), direction.y(), direction.z()};
        view.angle_rad.at<float>(y, x) = static_cast<float>(angle_rad);
        view.valid.at<uint8_t>(y, x) = angle_rad <= 0.5 * camera.field_of_view_rad ? 255 : 0;
      }
    }
  }
  return view;
}

size_t SmallView::sectorOf(int y, int x, size_t num_sectors) const {
  const double turn =
      std::atan2(static_cast<float>(y) - centre.y, static_cast<float>(x) - centre.x) / (2.0 * CV_PI) + 0.5;
  return std::min(num_sectors - 1, static_cast<size_t>(turn * static_cast<double>(num_sectors)));
}

cv::Mat shrink(const cv::Mat& pixels, cv::Size size) {
  cv::Mat result;
  cv::resize(pixels, result, size, 0, 0, cv::INTER_AREA);
  return result;
}

StaticStructure findStaticStructure(const SmallView& view, const std::vector<cv::Mat>& images,
                                    const std::vector<double>& weights) {
  StaticStructure found;
  found.mean = meanOf(images, weights, view.size);
  const double noise = noiseOf(view, images);
  const double black = blackOf(view, found.mean);
  found.fading = rimFading(view, cv::max(found.mean - black, 0.0));
  const cv::Mat& fading = found.fading;
  found.light = cv::max(found.mean - black, 0.0) / fading;
  const Smoothing fine(view.valid, kFine_px), coarse(view.valid, kCoarse_px);
  const auto zeros = [&] { return cv::Mat(cv::Mat::zeros(view.size, CV_32FC1)); };
  found.edge_x = zeros();
  found.edge_y = zeros();
  cv::Mat sum = zeros(), sum_square = zeros(), sum_noise = zeros();
  double total = 0.0, total_square = 0.0;
  for (size_t i = 0; i < images.size(); ++i) {
    if (images[i].empty()) {
      continue;
    }
    cv::Mat light;
    images[i].convertTo(light, CV_32F, 1.0, -black);
    light /= fading;
    const cv::Mat smooth = fine(light), background = coarse(light);
    const cv::Mat brightness = cv::max(background, 0.0) + kDark / fading;
    const cv::Mat noise_contrast = noise / fading / brightness;
    cv::Mat x, y, length;
    cv::Sobel(smooth, x, CV_32F, 1, 0, 3, 0.125);
    cv::Sobel(smooth, y, CV_32F, 0, 1, 3, 0.125);
    cv::magnitude(x, y, length);
    length += brightness.mul(kEdgeContrast + 2.0 * kGradientNoise * noise_contrast);
    cv::scaleAdd(x / length, weights[i], found.edge_x, found.edge_x);
    cv::scaleAdd(y / length, weights[i], found.edge_y, found.edge_y);
    const cv::Mat contrast = (smooth - background) / brightness;
    cv::scaleAdd(contrast, weights[i], sum, sum);
    cv::scaleAdd(contrast.mul(contrast), weights[i], sum_square, sum_square);
    cv::scaleAdd(noise_contrast.mul(noise_contrast), weights[i] * kContrastNoise * kContrastNoise, sum_noise,
                 sum_noise);
    total += weights[i];
    total_square += weights[i] * weights[i];
  }
  found.edge_x /= total;
  found.edge_y /= total;
  removeRimEdge(view, &found);
  sum /= total;
  const double unbiased = 1.0 / std::max(1e-3, 1.0 - total_square / (total * total));
  cv::Mat variance = (sum_square / total - sum.mul(sum)) * unbiased - sum_noise / total;
  variance = cv::max(variance, 0.0);
  cv::sqrt(fine(variance), found.moving);
  cv::magnitude(found.edge_x, found.edge_y, found.edge);
  std::vector<double> moving, noises;
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      if (view.valid.at<uint8_t>(y, x) != 0 && found.edge.at<float>(y, x) < kStaticEdge) {
        moving.push_back(found.moving.at<float>(y, x));
        noises.push_back(std::sqrt(sum_noise.at<float>(y, x) / total));
      }
    }
  }
  if (!moving.empty()) {
    found.typical_moving = quantile(moving, 0.5);
    if (found.typical_moving < kMinMoving * quantile(noises, 0.5)) {
      found.typical_moving = 0.0;
    }
  }
  return found;
}

}  // namespace vcharge::internal
