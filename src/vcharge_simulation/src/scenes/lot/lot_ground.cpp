#include "scenes/lot/lot_ground.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

namespace {

/// Oil, tar or a patch of repaired asphalt.
struct Stain {
  float x, y, half_length, half_width, cosine, sine, strength;
  bool is_patch;
};

class GroundPainter {
 public:
  GroundPainter(const LotLayout& layout, uint64_t seed)
      : layout_(layout), seed_(static_cast<uint32_t>(seed * 7919U)) {
    Random random(seed + 5);
    for (int i = 0; i < 420; ++i) {
      Stain stain{};
      stain.is_patch = i < 40;
      stain.x = static_cast<float>(random.uniform(kLotArea.min_x, kLotArea.max_x));
      stain.y = static_cast<float>(random.uniform(-23.0, 23.0));
      const double size = stain.is_patch ? random.uniform(0.4, 2.2) : 0.05 * std::pow(14.0, random.uniform());
      stain.half_length = static_cast<float>(size);
      stain.half_width = static_cast<float>(size * random.uniform(0.3, 1.0));
      const double yaw = stain.is_patch && random.chance(0.6) ? 0.0 : random.uniform(0.0, 3.14);
      stain.cosine = static_cast<float>(std::cos(yaw));
      stain.sine = static_cast<float>(std::sin(yaw));
      stain.strength =
          static_cast<float>(stain.is_patch ? random.uniform(-0.3, 0.22) : random.uniform(-0.55, 0.3));
      stains_.push_back(stain);
    }
  }

  Paving pavingAt(float x, float y) const {
    if (layout_.groundHeight(x, y) > 0.0) {
      return Paving::kGrass;
    }
    const auto found = std::find_if(layout_.paving.begin(), layout_.paving.end(), [&](const PavedArea& area) {
      return x > area.min_x && x < area.max_x && y > area.min_y && y < area.max_y;
    });
    return found == layout_.paving.end() ? Paving::kAsphalt : found->paving;
  }

  float albedo(float x, float y, float marking) const {
    float value = 0.0F;
    // Zone borders vary by a few centimetres.
    const float wander = 0.04F * valueNoise(x * 2.1F, y * 2.1F, seed_ + 1);
    const Paving paving = pavingAt(x + wander, y - wander);
    switch (paving) {
      case Paving::kAsphalt:
        value = asphalt(x, y);
        break;
      case Paving::kCobbles:
        value = blocks(x, y, 0.19F, 0.27F, 0.011F, 0.2F, 0.30F);
        break;
      case Paving::kBricks:
        value = blocks(x, y, 0.105F, 0.21F, 0.005F, 0.24F, 0.20F);
        break;
      case Paving::kSlabs:
        value = blocks(x, y, 0.42F, 0.62F, 0.008F, 0.36F, 0.12F);
        break;
      case Paving::kGrass:
        return grass(x, y);
    }
    // Large-scale weathering makes every part of the ground distinct.
    value *= 1.0F + 0.20F * fractalNoise(x * 0.13F, y * 0.13F, 3, 0.6F, seed_ + 2) +
             0.12F * fractalNoise(x * 1.1F, y * 1.1F, 3, 0.7F, seed_ + 3);
    value *= stainFactor(x, y);
    return mark(value, x, y, marking);
  }

 private:
  float asphalt(float x, float y) const {
    const float grain = fractalNoise(x * 38.0F, y * 38.0F, 2, 0.9F, seed_ + 10);
    const float mottle = fractalNoise(x * 7.0F, y * 7.0F, 3, 0.7F, seed_ + 11);
    float value = 0.21F * (1.0F + 0.17F * grain + 0.13F * mottle);
    // Bright and dark stones in the asphalt.
    const CellNoise stones = cellNoise(x * 26.0F, y * 26.0F, seed_ + 12);
    const float stone = unitFromBits(mixBits(stones.cell));
    if (stone > 0.86F) {
      value *= 1.0F + 1.1F * ramp(stones.border_distance, 0.05F, 0.25F) * (stone - 0.6F);
    } else if (stone < 0.1F) {
      value *= 1.0F - 0.35F * ramp(stones.border_distance, 0.05F, 0.2F);
    }
    return value * crackFactor(x, y);
  }

  float crackFactor(float x, float y) const {
    const float presence = valueNoise(x * 0.17F, y * 0.17F, seed_ + 20);
    if (presence < -0.35F) {
      return 1.0F;
    }
    const float warp_x = x + 0.25F * fractalNoise(x * 2.0F, y * 2.0F, 3, 0.6F, seed_ + 21);
    const float warp_y = y + 0.25F * fractalNoise(x * 2.0F, y * 2.0F, 3, 0.6F, seed_ + 22);
    const float scale = presence > 0.35F ? 1.5F : 0.45F;
    const CellNoise cells = cellNoise(warp_x * scale, warp_y * scale, seed_ + 23);
    const float width_m = 0.006F + 0.012F * std::clamp(presence, 0.0F, 1.0F);
    const float distance_m = cells.border_distance / scale;
    return 1.0F - 0.62F * (1.0F - ramp(distance_m, 0.4F * width_m, 1.6F * width_m));
  }

  // Rows of stones of random length with worn edges; brightness varies by `contrast`.
  float blocks(float x, float y, float row_m, float length_m, float joint_m, float base,
               float contrast) const {
    const float warp = row_m * 0.16F;
    const float wx = x + warp * valueNoise(x * 1.7F / row_m * 0.3F, y * 1.7F / row_m * 0.3F, seed_ + 30);
    const float wy = y + warp * valueNoise(x * 1.1F / row_m * 0.3F, y * 1.1F / row_m * 0.3F, seed_ + 31);
    const int row = static_cast<int>(std::floor(wy / row_m));
    const float in_row = wy / row_m - static_cast<float>(row);
    const float shifted = wx / length_m + cellValue(row, 7, seed_ + 32);
    int stone = static_cast<int>(std::floor(shifted));
    const auto border = [&](int index) {
      return static_cast<float>(index) + 0.5F * (cellValue(index, row, seed_ + 33) - 0.5F);
    };
    if (shifted < border(stone)) {
      --stone;
    } else if (shifted >= border(stone + 1)) {
      ++stone;
    }
    const float to_end = std::min(shifted - border(stone), border(stone + 1) - shifted) * length_m;
    const float to_side = std::min(in_row, 1.0F - in_row) * row_m;
    const float ragged = 0.35F * joint_m * valueNoise(x * 60.0F, y * 60.0F, seed_ + 34) +
                         0.5F * joint_m * valueNoise(x * 15.0F, y * 15.0F, seed_ + 39);
    const float edge_m = std::min(to_end, to_side) + ragged;
    const uint32_t hash = hashCell(stone, row, seed_ + 35);
    const float tone = unitFromBits(hash) - 0.5F;
    float value = base * (1.0F + 2.0F * contrast * tone);
    if ((hash & 63U) == 0) {
      value *= 1.7F;  // a repaired or painted stone
    }
    const float offset = static_cast<float>(hash & 1023U);
    value *= 1.0F + 0.16F * fractalNoise(x * 14.0F + offset, y * 14.0F, 3, 0.75F, seed_ + 36) +
             0.07F * valueNoise(x * 55.0F, y * 55.0F + offset, seed_ + 40);
    const float lichen = fractalNoise(x * 5.0F, y * 5.0F, 3, 0.7F, seed_ + 37);
    value *= 1.0F + 0.9F * ramp(lichen, 0.75F, 1.3F);
    // Joints contain dark soil or bright sand, and edges are slightly brighter.
    const float sand =
        valueNoise(x * 0.6F, y * 0.6F, seed_ + 38) + 0.6F * valueNoise(x * 6.0F, y * 6.0F, seed_ + 41);
    const float joint = base * (0.55F + 0.75F * ramp(sand, 0.1F, 1.0F));
    const float in_stone = ramp(edge_m, 0.5F * joint_m, 1.5F * joint_m);
    const float rim =
        ramp(edge_m, joint_m, 2.0F * joint_m) * (1.0F - ramp(edge_m, 2.0F * joint_m, 5.0F * joint_m));
    return joint + in_stone * (value * (1.0F + 0.12F * rim) - joint);
  }

  float grass(float x, float y) const {
    const float blades = fractalNoise(x * 24.0F, y * 24.0F, 3, 0.85F, seed_ + 50);
    const float tufts = fractalNoise(x * 2.2F, y * 2.2F, 4, 0.7F, seed_ + 51);
    const float bare = ramp(fractalNoise(x * 0.5F, y * 0.5F, 4, 0.6F, seed_ + 52), 0.2F, 0.7F);
    const float green = 0.14F * (1.0F + 0.42F * blades + 0.3F * tufts);
    const float soil = 0.17F * (1.0F + 0.3F * blades + 0.15F * tufts);
    float value = green + bare * (soil - green);
    const CellNoise litter = cellNoise(x * 11.0F, y * 11.0F, seed_ + 53);
    if ((litter.cell & 7U) == 0) {
      value += 0.2F * ramp(litter.border_distance, 0.15F, 0.25F);  // fallen leaves, daisies
    }
    return value;
  }

  float stainFactor(float x, float y) const {
    float factor = 1.0F;
    for (const Stain& stain : stains_) {
      const float dx = x - stain.x;
      const float dy = y - stain.y;
      const float reach = 1.5F * stain.half_length;
      if (std::abs(dx) > reach || std::abs(dy) > reach) {
        continue;
      }
      const float along = (dx * stain.cosine + dy * stain.sine) / stain.half_length;
      const float across = (dy * stain.cosine - dx * stain.sine) / stain.half_width;
      if (stain.is_patch) {
        const float outside = std::max(std::abs(along), std::abs(across));
        const float seam_m = std::abs(1.0F - outside) * stain.half_width;
        factor *= outside < 1.0F ? 1.0F + stain.strength : 1.0F;
        factor *= 1.0F - 0.45F * (1.0F - ramp(seam_m, 0.008F, 0.022F));
      } else {
        const float wobble = 0.35F * fractalNoise(x * 6.0F / stain.half_length * 0.4F,
                                                  y * 6.0F / stain.half_length * 0.4F, 3, 0.6F, seed_ + 60);
        const float radius = std::sqrt(along * along + across * across) + wobble;
        factor *= 1.0F + stain.strength * (1.0F - ramp(radius, 0.55F, 0.95F));
      }
    }
    return factor;
  }

  float mark(float value, float x, float y, float marking) const {
    if (marking <= 0.0F) {
      return value;
    }
    const float worn = fractalNoise(x * 3.0F, y * 3.0F, 4, 0.75F, seed_ + 70) +
                       0.7F * valueNoise(x * 45.0F, y * 45.0F, seed_ + 71);
    const float cover = marking * (1.0F - ramp(worn, 0.1F, 0.9F));
    return value + cover * (0.62F - value);
  }

  const LotLayout& layout_;
  uint32_t seed_;
  std::vector<Stain> stains_;
};

uint8_t toTexel(float albedo) {
  return cv::saturate_cast<uint8_t>(albedo * (255.0F / kGroundLayerAlbedo));
}

}  // namespace

cv::Mat drawLotGround(const LotLayout& layout, double texel_m, uint64_t seed) {
  const cv::Mat markings = drawLotMarkings(layout, texel_m, seed);
  const GroundPainter painter(layout, seed);
  cv::Mat image(markings.size(), CV_8UC1);
  tbb::parallel_for(0, image.rows, [&](int row) {
    const auto y = static_cast<float>(kLotArea.min_y + (row + 0.5) * texel_m);
    const uint8_t* marking = markings.ptr(row);
    uint8_t* out = image.ptr(row);
    for (int column = 0; column < image.cols; ++column) {
      const auto x = static_cast<float>(kLotArea.min_x + (column + 0.5) * texel_m);
      out[column] = toTexel(painter.albedo(x, y, static_cast<float>(marking[column]) / 255.0F));
    }
  });
  return image;
}

cv::Mat drawFarGround(double min_m, double size_m, double texel_m, uint64_t seed) {
  const int size = static_cast<int>(std::lround(size_m / texel_m));
  const auto noise_seed = static_cast<uint32_t>(seed * 104729U + 3U);
  cv::Mat image(size, size, CV_8UC1);
  tbb::parallel_for(0, size, [&](int row) {
    for (int column = 0; column < size; ++column) {
      const auto x = static_cast<float>(min_m + (column + 0.5) * texel_m);
      const auto y = static_cast<float>(min_m + (row + 0.5) * texel_m);
      const bool street = std::abs(std::abs(y) - 64.0F) < 3.5F || std::abs(std::abs(x) - 72.0F) < 3.5F ||
                          (std::abs(x - 30.0F) < 5.0F && y < 0.0F);
      const float patches = fractalNoise(x * 0.05F, y * 0.05F, 5, 0.65F, noise_seed);
      const float fine = fractalNoise(x * 0.7F, y * 0.7F, 3, 0.8F, noise_seed + 9);
      image.at<uint8_t>(row, column) =
          toTexel(street ? 0.24F * (1.0F + 0.08F * fine) : 0.16F * (1.0F + 0.3F * patches + 0.2F * fine));
    }
  });
  return image;
}

cv::Mat drawGroundDetail(int size, uint64_t seed) {
  // High-pass noise: white noise minus its blur, periodic at the borders of the tile.
  cv::Mat white(size, size, CV_32FC1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      white.at<float>(y, x) = cellValue(x, y, static_cast<uint32_t>(seed)) - 0.5F;
    }
  }
  constexpr int kPad = 16;
  cv::Mat padded;
  cv::copyMakeBorder(white, padded, kPad, kPad, kPad, kPad, cv::BORDER_WRAP);
  cv::Mat fine;
  cv::Mat medium;
  cv::Mat coarse;
  cv::GaussianBlur(padded, fine, cv::Size(), 0.7);
  cv::GaussianBlur(padded, medium, cv::Size(), 1.6);
  cv::GaussianBlur(padded, coarse, cv::Size(), 4.0);
  const cv::Mat relief = 0.5 * (fine - medium) + 1.6 * (medium - coarse);
  cv::Mat image;
  relief(cv::Rect(kPad, kPad, size, size)).convertTo(image, CV_8UC1, 255.0, 127.5);
  return image;
}

}  // namespace vcharge
