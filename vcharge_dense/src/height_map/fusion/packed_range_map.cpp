#include "height_map/fusion/packed_range_map.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Neighbouring pixels belong to one surface if their inverse ranges differ by less than this fraction.
constexpr float kMaxRelativeChange = 0.15F;

// Ranges with a lower confidence or a larger relative standard deviation are left out. A confidence of 0.7
// left gaps without making distances in the map more accurate.
constexpr float kMinConfidence = 0.5F, kMaxRelativeSigma = 0.08F;

/// Change of the inverse range per pixel, from the neighbours that belong to the same surface.
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

// The weight does not grow beyond this confidence.
constexpr float kFullConfidence = 0.99F;

float logOdds(float confidence) {
  return std::log(confidence / (1.0F - confidence));
}

/// Weight of a range from its standard deviation, its confidence and the length of surface that its pixel
/// spans. `pixel_rad`: angle of a pixel; `by_column` and `by_row`: changes of the inverse range per pixel.
class RangeWeight {
 public:
  RangeWeight(const RangeWeighting& weighting, float pixel_rad)
      : inverse_sigma_(static_cast<float>(1.0 / weighting.reference_sigma_m)),
        inverse_footprint_(static_cast<float>(1.0 / weighting.reference_footprint_m)),
        confident_weight_(static_cast<float>(weighting.view_weight) /
                          logOdds(static_cast<float>(weighting.reference_confidence))),
        pixel_rad_(pixel_rad) {}

  float operator()(float inverse_range, float sigma_m, float confidence, float by_column,
                   float by_row) const {
    const float range = 1.0F / inverse_range;
    const float along = range * range * std::max(std::abs(by_column), std::abs(by_row));
    const float footprint_squared = squared(range * pixel_rad_) + squared(along);
    const float confident = confident_weight_ * logOdds(std::clamp(confidence, 0.5F, kFullConfidence));
    return confident / ((1.0F + squared(sigma_m * inverse_sigma_)) *
                        (1.0F + footprint_squared * squared(inverse_footprint_)));
  }

 private:
  const float inverse_sigma_, inverse_footprint_, confident_weight_, pixel_rad_;
};

cv::Mat inverseRange(const RangeMap& map, size_t* num_known) {
  cv::Mat inverse(map.range_m.size(), CV_32FC1, cv::Scalar(0));
  for (int y = 0; y < inverse.rows; ++y) {
    const auto* range = map.range_m.ptr<float>(y);
    const auto* sigma = map.standard_deviation_m.ptr<float>(y);
    const auto* confidence = map.confidence.ptr<float>(y);
    auto* out = inverse.ptr<float>(y);
    for (int x = 0; x < inverse.cols; ++x) {
      const bool known = std::isfinite(range[x]) && range[x] > 0.0F && std::isfinite(sigma[x]) &&
                         sigma[x] > 0.0F && sigma[x] <= kMaxRelativeSigma * range[x] &&
                         confidence[x] >= kMinConfidence;
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
                            const RangeWeighting& weighting) {
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

  const RangeWeight weightOf(weighting, (1.0F + packed.xi) / packed.fx);  // angle of a pixel in the middle
  const cv::Mat inverse = inverseRange(map, &packed.num_known);
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
