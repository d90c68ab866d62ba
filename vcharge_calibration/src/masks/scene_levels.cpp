#include "masks/scene_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "vcharge_core/base/quantile.h"

namespace vcharge::internal {
namespace {

// Elevations from the nadir to the zenith.
constexpr size_t kNumBins = 45;
// Below this elevation the ground is seen, whatever the height of the camera.
constexpr float kGround_rad = -0.25F;
// Every n-th pixel in both directions serves to find the vertical.
constexpr int kStep = 4;
constexpr double kMaxRoll_rad = 0.44, kMinPitch_rad = -0.35, kMaxPitch_rad = 1.4;
constexpr double kCoarse_rad = 0.0873, kFine_rad = 0.0175;
// Quantiles 0.15, 0.4 and 0.7 of the Rayleigh distribution, which the lengths of random directions have.
constexpr double kRayleigh15 = 0.5701, kRayleigh40 = 1.0108, kRayleigh70 = 1.5518;
constexpr double kMinEdgeNoise = 0.02, kMaxEdgeNoise = 0.2;
// A bin with fewer pixels takes the levels of its neighbours.
constexpr size_t kMinPixels = 60;

/// The way down for a camera that looks down by `pitch_rad` and whose image is rolled by `roll_rad`.
cv::Vec3f downOf(double pitch_rad, double roll_rad) {
  return {static_cast<float>(std::cos(pitch_rad) * std::sin(roll_rad)),
          static_cast<float>(std::cos(pitch_rad) * std::cos(roll_rad)),
          static_cast<float>(std::sin(pitch_rad))};
}

float elevationOf(const cv::Vec3f& ray, const cv::Vec3f& down) {
  return std::asin(std::clamp(-ray.dot(down), -1.0F, 1.0F));
}

size_t binOf(float elevation_rad) {
  const double part = elevation_rad / CV_PI + 0.5;
  return static_cast<size_t>(
      std::clamp(static_cast<int>(part * kNumBins), 0, static_cast<int>(kNumBins) - 1));
}

/// Mean absolute deviation of values from the median at their elevation.
class VerticalSearch {
 public:
  VerticalSearch(const SmallView& view, const cv::Mat& log_moving) {
    for (int y = 0; y < view.size.height; y += kStep) {
      for (int x = 0; x < view.size.width; x += kStep) {
        if (view.valid.at<uint8_t>(y, x) != 0) {
          rays_.push_back(view.rays.at<cv::Vec3f>(y, x));
          values_.push_back(log_moving.at<float>(y, x));
        }
      }
    }
  }

  cv::Vec3f best() const {
    double pitch_rad = 0.0, roll_rad = 0.0, least = std::numeric_limits<double>::infinity();
    const auto search = [&](double from_pitch, double to_pitch, double from_roll, double to_roll,
                            double step) {
      for (double pitch = from_pitch; pitch <= to_pitch + 1e-9; pitch += step) {
        for (double roll = from_roll; roll <= to_roll + 1e-9; roll += step) {
          const double deviation = deviationAt(downOf(pitch, roll));
          if (deviation < least) {
            least = deviation;
            pitch_rad = pitch;
            roll_rad = roll;
          }
        }
      }
    };
    search(kMinPitch_rad, kMaxPitch_rad, -kMaxRoll_rad, kMaxRoll_rad, kCoarse_rad);
    const double pitch = pitch_rad, roll = roll_rad, reach = 2.0 * kCoarse_rad / 3.0;
    search(pitch - reach, pitch + reach, roll - reach, roll + reach, kFine_rad);
    return downOf(pitch_rad, roll_rad);
  }

 private:
  double deviationAt(const cv::Vec3f& down) const {
    std::vector<std::vector<float>> bins(kNumBins);
    for (size_t i = 0; i < rays_.size(); ++i) {
      bins[binOf(elevationOf(rays_[i], down))].push_back(values_[i]);
    }
    double sum = 0.0;
    for (std::vector<float>& bin : bins) {
      if (bin.empty()) {
        continue;
      }
      const auto middle = bin.begin() + static_cast<std::ptrdiff_t>(bin.size() / 2);
      std::nth_element(bin.begin(), middle, bin.end());
      for (const float value : bin) {
        sum += std::abs(value - *middle);
      }
    }
    return sum;
  }

  std::vector<cv::Vec3f> rays_;
  std::vector<float> values_;
};

/// Empty values become those of the nearest bin that has one.
void fillGaps(std::vector<double>* levels) {
  const std::vector<double> known = *levels;
  for (size_t bin = 0; bin < known.size(); ++bin) {
    for (size_t step = 0; std::isnan((*levels)[bin]) && step < known.size(); ++step) {
      for (const size_t other : {bin - std::min(bin, step), std::min(known.size() - 1, bin + step)}) {
        if (std::isnan((*levels)[bin]) && !std::isnan(known[other])) {
          (*levels)[bin] = known[other];
        }
      }
    }
  }
}

/// Combines each value with those of its two neighbours.
template <typename Combine>
std::vector<double> ofNeighbours(const std::vector<double>& levels, const Combine& combine) {
  std::vector<double> result = levels;
  for (size_t bin = 0; bin + 1 < levels.size(); ++bin) {
    result[bin] = combine(result[bin], levels[bin + 1]);
    result[bin + 1] = combine(result[bin + 1], levels[bin]);
  }
  return result;
}

}  // namespace

SceneLevels findSceneLevels(const SmallView& view, const StaticStructure& structure) {
  SceneLevels levels;
  cv::Mat log_moving;
  cv::log(cv::max(structure.moving / structure.typical_moving, 0.02), log_moving);
  levels.down = VerticalSearch(view, log_moving).best();
  levels.elevation_rad = cv::Mat(view.size, CV_32FC1);
  std::vector<std::vector<double>> moving(kNumBins), edges(kNumBins);
  std::vector<double> ground_moving, ground_edges;
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const float elevation_rad = elevationOf(view.rays.at<cv::Vec3f>(y, x), levels.down);
      levels.elevation_rad.at<float>(y, x) = elevation_rad;
      if (view.valid.at<uint8_t>(y, x) == 0) {
        continue;
      }
      const size_t bin = binOf(elevation_rad);
      const float edge = structure.edge.at<float>(y, x);
      edges[bin].push_back(edge);
      moving[bin].push_back(structure.moving.at<float>(y, x));
      if (elevation_rad < kGround_rad) {
        ground_edges.push_back(edge);
        if (edge < kStaticEdge) {
          ground_moving.push_back(structure.moving.at<float>(y, x));
        }
      }
    }
  }
  const double ground_level = ground_moving.empty() ? structure.typical_moving : quantile(ground_moving, 0.5);
  // The body may fill most of the ground, with edges that are longer than those of the scene.
  const double ground_noise =
      ground_edges.empty() ? kMinEdgeNoise : quantile(ground_edges, 0.15) / kRayleigh15;
  std::vector<double> moving_levels(kNumBins, std::numeric_limits<double>::quiet_NaN());
  std::vector<double> noise_levels = moving_levels;
  for (size_t bin = 0; bin < kNumBins; ++bin) {
    if (moving[bin].size() < kMinPixels) {
      continue;
    }
    const double upper_end_rad = (static_cast<double>(bin + 1) / kNumBins - 0.5) * CV_PI;
    const bool is_ground = upper_end_rad <= kGround_rad;
    const double level = quantile(moving[bin], 0.5);
    moving_levels[bin] = is_ground ? std::max(level, ground_level) : level;
    noise_levels[bin] = is_ground ? ground_noise
                                  : std::max(quantile(edges[bin], 0.4) / kRayleigh40,
                                             quantile(edges[bin], 0.7) / kRayleigh70);
  }
  fillGaps(&moving_levels);
  fillGaps(&noise_levels);
  // Elevations are known to within a bin.
  moving_levels = ofNeighbours(moving_levels, [](double a, double b) { return std::min(a, b); });
  noise_levels = ofNeighbours(noise_levels, [](double a, double b) { return std::max(a, b); });
  levels.moving = cv::Mat(view.size, CV_32FC1, cv::Scalar(0.0));
  levels.edge_noise = cv::Mat(view.size, CV_32FC1, cv::Scalar(kMinEdgeNoise));
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      if (view.valid.at<uint8_t>(y, x) == 0) {
        continue;
      }
      const size_t bin = binOf(levels.elevation_rad.at<float>(y, x));
      levels.moving.at<float>(y, x) = static_cast<float>(moving_levels[bin]);
      levels.edge_noise.at<float>(y, x) =
          static_cast<float>(std::clamp(noise_levels[bin], kMinEdgeNoise, kMaxEdgeNoise));
    }
  }
  return levels;
}

}  // namespace vcharge::internal
