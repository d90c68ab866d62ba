#include "height_map/fusion/packed_range_map.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Pixels of one surface differ by less than this share of their inverse range.
constexpr float kMaxRelativeChange = 0.15F;

/// Half the difference between the neighbours on both sides, or the difference to the one that is near.
float changeAcross(float before, float here, float after) {
  const float limit = kMaxRelativeChange * here;
  const bool has_before = before > 0.0F && std::abs(here - before) < limit;
  const bool has_after = after > 0.0F && std::abs(after - here) < limit;
  if (has_before && has_after) {
    return 0.5F * (after - before);
  }
  return has_before ? here - before : has_after ? after - here : 0.0F;
}

float squared(float value) {
  return value * value;
}

// A range more confident than this one counts no more.
constexpr float kFullConfidence = 0.99F;

float logOdds(float confidence) {
  return std::log(confidence / (1.0F - confidence));
}

/// Weight of a range by its sigma, its confidence and by how much of the surface its pixel spans.
/// `pixel_rad`: angle of a pixel; changes of the inverse range to the neighbours.
class RangeWeight {
 public:
  RangeWeight(const HeightFusionOptions& options, float pixel_rad)
      : inverse_sigma_(static_cast<float>(1.0 / options.reference_sigma_m)),
        inverse_footprint_(options.reference_footprint_m > 0.0
                               ? static_cast<float>(1.0 / options.reference_footprint_m)
                               : 0.0F),
        inverse_log_odds_(options.reference_confidence > 0.0
                              ? 1.0F / logOdds(static_cast<float>(options.reference_confidence))
                              : 0.0F),
        pixel_rad_(pixel_rad) {}

  float operator()(float inverse_range, float sigma_m, float confidence, float by_column,
                   float by_row) const {
    const float range = 1.0F / inverse_range;
    const float along = range * range * std::max(std::abs(by_column), std::abs(by_row));
    const float footprint_squared = squared(range * pixel_rad_) + squared(along);
    const float sure = inverse_log_odds_ > 0.0F
                           ? inverse_log_odds_ * logOdds(std::clamp(confidence, 0.5F, kFullConfidence))
                           : 1.0F;
    return sure / ((1.0F + squared(sigma_m * inverse_sigma_)) *
                   (1.0F + footprint_squared * squared(inverse_footprint_)));
  }

 private:
  const float inverse_sigma_, inverse_footprint_, inverse_log_odds_, pixel_rad_;
};

cv::Mat inverseRange(const RangeMap& map, const HeightFusionOptions& options, size_t* num_known) {
  cv::Mat inverse(map.range_m.size(), CV_32FC1, cv::Scalar(0));
  for (int y = 0; y < inverse.rows; ++y) {
    const auto* range = map.range_m.ptr<float>(y);
    const auto* sigma = map.standard_deviation_m.ptr<float>(y);
    const auto* confidence = map.confidence.ptr<float>(y);
    auto* out = inverse.ptr<float>(y);
    for (int x = 0; x < inverse.cols; ++x) {
      const bool known = std::isfinite(range[x]) && range[x] > 0.0F && std::isfinite(sigma[x]) &&
                         sigma[x] > 0.0F &&
                         sigma[x] <= static_cast<float>(options.max_relative_sigma) * range[x] &&
                         confidence[x] >= static_cast<float>(options.min_confidence);
      if (known) {
        out[x] = 1.0F / range[x];
        ++*num_known;
      }
    }
  }
  return inverse;
}

}  // namespace

PackedRangeMap packRangeMap(const RangeMap& map, const RigidTransform& world_from_camera,
                            const HeightFusionOptions& options) {
  check(map.range_m.type() == CV_32FC1 && map.standard_deviation_m.size() == map.range_m.size() &&
            map.confidence.size() == map.range_m.size(),
        "packRangeMap: expected three CV_32FC1 images of one size");
  PackedRangeMap packed;
  packed.width = map.range_m.cols;
  packed.height = map.range_m.rows;
  packed.xi = static_cast<float>(map.camera.xi());
  packed.fx = static_cast<float>(map.camera.gamma1());
  packed.fy = static_cast<float>(map.camera.gamma2());
  packed.u0 = static_cast<float>(map.camera.u0());
  packed.v0 = static_cast<float>(map.camera.v0());
  packed.min_cosine = packed.xi > 1.0F ? -1.0F / packed.xi : -packed.xi;
  const Eigen::Matrix3d rotation = world_from_camera.rotationMatrix().transpose();
  for (int i = 0; i < 9; ++i) {
    packed.rotation[i] = static_cast<float>(rotation(i / 3, i % 3));
  }
  packed.position_m = world_from_camera.translation();

  const RangeWeight weightOf(options, (1.0F + packed.xi) / packed.fx);  // of a pixel in the middle
  const cv::Mat inverse = inverseRange(map, options, &packed.num_known);
  packed.values.resize(inverse.total() * PackedRangeMap::kValues);
  float* out = packed.values.data();
  for (int y = 0; y < inverse.rows; ++y) {
    const auto* row = inverse.ptr<float>(y);
    const auto* above = inverse.ptr<float>(y > 0 ? y - 1 : y);
    const auto* below = inverse.ptr<float>(y + 1 < inverse.rows ? y + 1 : y);
    const auto* sigma = map.standard_deviation_m.ptr<float>(y);
    const auto* confidence = map.confidence.ptr<float>(y);
    for (int x = 0; x < inverse.cols; ++x, out += PackedRangeMap::kValues) {
      const float here = row[x];
      const bool known = here > 0.0F;
      out[0] = here;
      out[1] = known ? changeAcross(x > 0 ? row[x - 1] : 0.0F, here, x + 1 < inverse.cols ? row[x + 1] : 0.0F)
                     : 0.0F;
      out[2] =
          known ? changeAcross(y > 0 ? above[x] : 0.0F, here, y + 1 < inverse.rows ? below[x] : 0.0F) : 0.0F;
      out[3] = known ? sigma[x] : 1.0F;
      out[4] = known ? weightOf(here, sigma[x], confidence[x], out[1], out[2]) : 0.0F;
    }
  }
  return packed;
}

}  // namespace vcharge
