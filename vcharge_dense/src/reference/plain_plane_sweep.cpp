#include "reference/plain_plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcharge {
namespace {

/// Mean distance between an inner plane and its two neighbours.
double stepAt(const PlaneFamily& family, size_t plane) {
  const std::vector<float>& inverse = family.inverse_distances_per_m;
  return 0.5 * (inverse[plane + 1] - inverse[plane - 1]);
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

int wrap(int value, int size) {
  return ((value % size) + size) % size;
}

/// Bilinear sample; NaN if one of the four pixels must not be used.
double sample(const cv::Mat& pixels, const cv::Mat& valid_mask, const Eigen::Vector2d& at,
              PlainBorder border) {
  const int x = static_cast<int>(std::floor(at.x()));
  const int y = static_cast<int>(std::floor(at.y()));
  double values[2][2];
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      int u = x + dx, v = y + dy;
      if (border == PlainBorder::kAsTheAuthors) {
        u = wrap(u, pixels.cols);
        v = wrap(v, pixels.rows);
      } else if (u < 0 || v < 0 || u >= pixels.cols || v >= pixels.rows ||
                 valid_mask.at<uint8_t>(v, u) == 0) {
        return kNaN;
      }
      values[dy][dx] = pixels.at<uint8_t>(v, u);
    }
  }
  const double fx = at.x() - x, fy = at.y() - y;
  return (1 - fy) * ((1 - fx) * values[0][0] + fx * values[0][1]) +
         fy * ((1 - fx) * values[1][0] + fx * values[1][1]);
}

/// Sum over the window around each pixel; NaN where the window leaves the image.
cv::Mat windowSum(const cv::Mat& values, int radius) {
  const auto sumAlong = [&](const cv::Mat& from, int step_x, int step_y) {
    cv::Mat sum(from.size(), CV_64FC1);
    for (int y = 0; y < from.rows; ++y) {
      for (int x = 0; x < from.cols; ++x) {
        double total = 0.0;
        for (int k = -radius; k <= radius; ++k) {
          const int u = x + k * step_x, v = y + k * step_y;
          const bool inside = u >= 0 && v >= 0 && u < from.cols && v < from.rows;
          total += inside ? from.at<double>(v, u) : kNaN;
        }
        sum.at<double>(y, x) = total;
      }
    }
    return sum;
  };
  return sumAlong(sumAlong(values, 1, 0), 0, 1);
}

/// Warps a neighbour into the reference, whose rays are given, over a plane (paper, equation (warping)).
cv::Mat warp(const MeiCamera& camera, const cv::Mat& valid_mask, const RayTable& rays, const Plane& plane,
             const SweepImage& reference, const SweepImage& neighbour, PlainBorder border) {
  const RigidTransform neighbour_from_reference =
      neighbour.world_from_camera.inverse() * reference.world_from_camera;
  const Eigen::Matrix3d homography =
      neighbour_from_reference.rotationMatrix() -
      neighbour_from_reference.translation() * plane.normal.transpose() / plane.distance_m;
  cv::Mat warped(rays.size(), CV_64FC1, cv::Scalar(kNaN));
  for (int y = 0; y < warped.rows; ++y) {
    for (int x = 0; x < warped.cols; ++x) {
      const Eigen::Vector3d ray = rays.ray(x, y).cast<double>();
      Eigen::Vector2d pixel;
      if (-plane.normal.dot(ray) > 1e-3 && camera.project(homography * ray, &pixel)) {
        warped.at<double>(y, x) = sample(neighbour.pixels, valid_mask, pixel, border);
      }
    }
  }
  return warped;
}

double aggregate(const PlaneSweepOptions& options, const std::vector<double>& scores,
                 const std::vector<bool>& after) {
  double sum[2] = {0.0, 0.0};
  int votes[2] = {0, 0};
  for (size_t n = 0; n < scores.size(); ++n) {
    if (!std::isnan(scores[n])) {
      sum[after[n] ? 1 : 0] += scores[n];
      ++votes[after[n] ? 1 : 0];
    }
  }
  if (votes[0] + votes[1] == 0) {
    return kNaN;
  }
  switch (options.aggregation) {
    case Aggregation::kMean:
      return (sum[0] + sum[1]) / (votes[0] + votes[1]);
    case Aggregation::kReferenceSplit: {
      const double before_mean = votes[0] > 0 ? sum[0] / votes[0] : -2.0;
      const double after_mean = votes[1] > 0 ? sum[1] / votes[1] : -2.0;
      return std::max(before_mean, after_mean);
    }
  }
  return kNaN;
}

}  // namespace

PlainResult plainPlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask,
                            const std::vector<PlaneFamily>& families, const PlaneSweepOptions& options,
                            const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                            PlainBorder border) {
  const int radius = kMatchingWindow_px / 2;
  const double count = kMatchingWindow_px * kMatchingWindow_px;
  // For windows across the border the authors repeat the reference's last pixel, but warp the neighbours to
  // the rays of the pixels outside the image.
  const double without_texture = border == PlainBorder::kAsTheAuthors ? 0.0 : kNaN;
  const int margin = border == PlainBorder::kAsTheAuthors ? radius : 0;
  cv::Mat pixels;
  cv::copyMakeBorder(reference.pixels, pixels, margin, margin, margin, margin, cv::BORDER_REPLICATE);
  const cv::Size size = pixels.size();
  const MeiCamera wide_camera(camera.xi(), camera.gamma1(), camera.gamma2(), camera.u0() + margin,
                              camera.v0() + margin);
  const RayTable rays(wide_camera, size, 6.283185307179586, margin == 0 ? valid_mask : cv::Mat());
  cv::Mat a;
  pixels.convertTo(a, CV_64F);
  if (border == PlainBorder::kUnknown) {
    a.setTo(kNaN, valid_mask == 0);
  }
  const cv::Mat sum_a = windowSum(a, radius);
  const cv::Mat sum_aa = windowSum(a.mul(a), radius);
  std::vector<bool> after;
  for (const SweepImage& neighbour : neighbours) {
    after.push_back(neighbour.stamp > reference.stamp);
  }

  PlainResult result{cv::Mat(size, CV_32SC1, cv::Scalar(-1)), cv::Mat(size, CV_64FC1, cv::Scalar(kNaN)),
                     cv::Mat(size, CV_64FC1, cv::Scalar(kNaN)), cv::Mat(size, CV_64FC1, cv::Scalar(kNaN))};
  int first_plane = 0;
  for (size_t f = 0; f < families.size(); ++f) {
    const PlaneFamily& family = families[f];
    const size_t num_planes = family.inverse_distances_per_m.size();
    std::vector<cv::Mat> scores(num_planes);
    for (size_t m = 0; m < num_planes; ++m) {
      const double inverse_distance = family.inverse_distances_per_m[m];
      std::vector<cv::Mat> correlations;
      for (const SweepImage& neighbour : neighbours) {
        const cv::Mat b = warp(camera, valid_mask, rays, {family.normal, 1.0 / inverse_distance}, reference,
                               neighbour, border);
        const cv::Mat sum_b = windowSum(b, radius);
        const cv::Mat sum_bb = windowSum(b.mul(b), radius);
        const cv::Mat sum_ab = windowSum(a.mul(b), radius);
        cv::Mat correlation(size, CV_64FC1, cv::Scalar(without_texture));
        for (int y = 0; y < size.height; ++y) {
          for (int x = 0; x < size.width; ++x) {
            const double mean_a = sum_a.at<double>(y, x) / count, mean_b = sum_b.at<double>(y, x) / count;
            const double variance_a = sum_aa.at<double>(y, x) / count - mean_a * mean_a;
            const double variance_b = sum_bb.at<double>(y, x) / count - mean_b * mean_b;
            const double covariance = sum_ab.at<double>(y, x) / count - mean_a * mean_b;
            if (variance_a >= std::max(2e-5, options.min_texture * options.min_texture) &&
                variance_b > 2e-5) {
              correlation.at<double>(y, x) = std::min(1.0, covariance / std::sqrt(variance_a * variance_b));
            }
          }
        }
        correlations.push_back(correlation);
      }
      scores[m] = cv::Mat(size, CV_64FC1, cv::Scalar(kNaN));
      std::vector<double> of_pixel(neighbours.size());
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          for (size_t n = 0; n < neighbours.size(); ++n) {
            of_pixel[n] = correlations[n].at<double>(y, x);
          }
          scores[m].at<double>(y, x) = aggregate(options, of_pixel, after);
        }
      }
    }
    // Finds the best plane of the family, and the maximum of the parabola through the scores around it.
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        size_t best = num_planes;
        for (size_t m = 0; m < num_planes; ++m) {
          const double score = scores[m].at<double>(y, x);
          if (!std::isnan(score) && (best == num_planes || score > scores[best].at<double>(y, x))) {
            best = m;
          }
        }
        const bool at_limit = best == 0 || best == num_planes - 1;
        if (best == num_planes || (f > 0 && at_limit) ||
            scores[best].at<double>(y, x) <= result.score.at<double>(y, x)) {
          continue;
        }
        const double score = scores[best].at<double>(y, x);
        double offset = 0.0;
        if (!at_limit) {
          const double before = scores[best - 1].at<double>(y, x), behind = scores[best + 1].at<double>(y, x);
          const double curvature = 2 * score - before - behind;
          if (curvature > 1e-6) {
            offset = std::clamp(0.5 * (behind - before) / curvature, -0.5, 0.5);
          }
        }
        const double step = offset != 0.0 ? stepAt(family, best) : 0.0;
        const double inverse_distance = family.inverse_distances_per_m[best] + offset * step;
        result.plane.at<int>(y, x) = first_plane + static_cast<int>(best);
        result.score.at<double>(y, x) = score;
        result.inverse_distance.at<double>(y, x) = inverse_distance;
        // Inverse of the paper's depth -d / (n . ray).
        result.inverse_range.at<double>(y, x) =
            -family.normal.dot(rays.ray(x, y).cast<double>()) * inverse_distance;
      }
    }
    first_plane += static_cast<int>(num_planes);
  }
  const cv::Rect image(margin, margin, reference.pixels.cols, reference.pixels.rows);
  for (cv::Mat* map : {&result.plane, &result.inverse_distance, &result.inverse_range, &result.score}) {
    *map = (*map)(image).clone();
  }
  return result;
}

}  // namespace vcharge
