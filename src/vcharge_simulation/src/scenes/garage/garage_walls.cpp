#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "scenes/garage/garage_surfaces.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

int texels(double metres) {
  return static_cast<int>(std::lround(metres * kGarageTexelsPerM));
}

void writeSign(const std::string& text, const cv::Point& corner, double scale, int ground, int ink,
               cv::Mat* image) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, scale, 2, &baseline);
  const cv::Rect board(corner.x, corner.y, size.width + 14, size.height + 14);
  cv::rectangle(*image, board, cv::Scalar(ground), cv::FILLED);
  cv::rectangle(*image, board, cv::Scalar(ink), 1);
  cv::putText(*image, text, {corner.x + 7, corner.y + size.height + 7}, cv::FONT_HERSHEY_DUPLEX, scale,
              cv::Scalar(ink), 2, cv::LINE_AA);
}

// Draws a poster: some shapes, a headline and lines of text.
void drawPoster(const cv::Point& corner, Random* random, cv::Mat* image) {
  const int width = texels(random->uniform(0.5, 0.9));
  const int height = texels(random->uniform(0.7, 1.1));
  const cv::Rect sheet =
      cv::Rect(corner.x, corner.y, width, height) & cv::Rect(0, 0, image->cols, image->rows);
  const bool bright = random->chance(0.7);
  const cv::Scalar paper(bright ? 215 : 60);
  const cv::Scalar ink(bright ? 25 : 220);
  cv::Mat poster(sheet.size(), CV_8UC1, paper);
  for (int i = 0; i < 5; ++i) {
    const cv::Point middle(random->index(sheet.width), random->index(std::max(1, 6 * sheet.height / 10)));
    const int tone = 30 + random->index(200);
    const int size = 4 + random->index(std::max(1, sheet.width / 4));
    if (random->chance(0.5)) {
      cv::circle(poster, middle, size, cv::Scalar(tone), cv::FILLED, cv::LINE_AA);
    } else {
      cv::rectangle(poster, cv::Rect(middle.x, middle.y, 2 * size, size), cv::Scalar(tone), cv::FILLED);
    }
  }
  cv::putText(poster, random->chance(0.5) ? "NEU" : "INFO", {4, 7 * sheet.height / 10},
              cv::FONT_HERSHEY_DUPLEX, 0.6, ink, 2, cv::LINE_AA);
  for (int y = 3 * sheet.height / 4; y < sheet.height - 4; y += 4) {
    cv::line(poster, {5, y}, {sheet.width / 2 + random->index(sheet.width / 2), y}, ink, 1);
  }
  cv::rectangle(poster, cv::Rect(0, 0, sheet.width, sheet.height), cv::Scalar(90), 1);
  poster.copyTo((*image)(sheet));
}

// Draws a random fixture at `x`: an exit sign, a door, a fire extinguisher, the name of the deck, a vent, a
// poster or a cable duct.
void drawFixture(int x, Random* random, cv::Mat* image) {
  const int top = texels(0.45 + 0.25 * random->uniform());
  const int kind = random->index(8);
  if (kind == 0) {
    static const std::array<const char*, 5> kTexts = {"AUSGANG", "<- EXIT", "LIFT", "KASSE ->", "NOTAUSGANG"};
    const int text = random->index(5);
    const double scale = random->uniform(0.6, 1.1);
    writeSign(kTexts[static_cast<size_t>(text)], {x, top}, scale, random->chance(0.5) ? 60 : 190,
              random->chance(0.5) ? 235 : 15, image);
  } else if (kind == 1) {
    const cv::Rect door(x, image->rows - texels(2.1), texels(1.0), texels(2.1));
    cv::rectangle(*image, door, cv::Scalar(60 + random->index(90)), cv::FILLED);
    cv::rectangle(*image, door, cv::Scalar(190), 3);
    cv::circle(*image, {x + texels(0.85), image->rows - texels(1.05)}, 3, cv::Scalar(210), cv::FILLED);
    writeSign("T" + std::to_string(10 + random->index(80)), {x + texels(0.25), door.y + texels(0.3)}, 0.5,
              215, 30, image);
  } else if (kind == 2) {
    const int level = image->rows - texels(1.5);
    cv::rectangle(*image, cv::Rect(x, level, texels(0.35), texels(0.7)), cv::Scalar(55), cv::FILLED);
    cv::rectangle(*image, cv::Rect(x + 4, level + 4, texels(0.35) - 8, texels(0.7) - 8), cv::Scalar(120), 2);
    writeSign("F", {x, level - texels(0.35)}, 0.6, 40, 230, image);
  } else if (kind == 3) {
    const std::string name = "P" + std::to_string(1 + random->index(4));
    cv::putText(*image, name, {x, image->rows - texels(1.3)}, cv::FONT_HERSHEY_DUPLEX, 2.2, cv::Scalar(25), 7,
                cv::LINE_AA);
  } else if (kind == 4) {
    const cv::Rect vent(x, top, texels(0.8), texels(0.4));
    cv::rectangle(*image, vent, cv::Scalar(35), cv::FILLED);
    for (int y = vent.y + 3; y < vent.y + vent.height; y += 5) {
      cv::line(*image, {vent.x, y}, {vent.x + vent.width, y}, cv::Scalar(130), 2);
    }
  } else if (kind < 7) {
    drawPoster({x, top}, random, image);
  } else {
    const int end = x + texels(random->uniform(0.5, 2.0));
    cv::line(*image, {x, top}, {end, top}, cv::Scalar(60), 4);
    cv::line(*image, {end, top}, {end, image->rows}, cv::Scalar(60), 4);
    cv::rectangle(*image, cv::Rect(end - 7, image->rows - texels(1.3), 15, 22), cv::Scalar(205), cv::FILLED);
  }
}

// Reflectance of bare concrete: formwork boards 0.25 m high with seams, tie holes, pores, exposed gravel and
// cracks.
float concrete(float u, float v, float mean, uint32_t seed) {
  constexpr float kBoard_m = 0.25F;
  const int board = static_cast<int>(std::floor(v / kBoard_m));
  const float board_start_m = 2.5F * cellValue(board, 0, seed + 6);
  const float along_board_m = u + board_start_m;
  float value =
      mean * (0.92F + 0.16F * cellValue(board, static_cast<int>(std::floor(along_board_m / 2.5F)), seed + 3));
  const float to_seam_m = std::min(std::abs(v - kBoard_m * std::round(v / kBoard_m)),
                                   std::abs(along_board_m - 2.5F * std::round(along_board_m / 2.5F)));
  if (to_seam_m < 0.012F) {
    value *= 0.78F + 0.3F * valueNoise(u * 2.0F, v * 2.0F, seed + 12);
  }
  value *= 1.0F + 0.14F * fractalNoise(u * 0.8F, v * 0.8F, 4, 0.7F, seed) +
           0.06F * fractalNoise(u * 13.0F, v * 13.0F, 2, 0.8F, seed + 7);
  // Tie holes every 1.25 m in two rows, some plugged with mortar.
  const float tie_u = 1.25F * std::round(u / 1.25F);
  const float tie_v = 1.0F * std::round((v - 0.62F) / 1.0F) + 0.62F;
  const float to_tie_m = std::hypot(u - tie_u, v - tie_v);
  if (to_tie_m < 0.035F) {
    const bool plugged = cellValue(static_cast<int>(std::lround(tie_u)), static_cast<int>(std::lround(tie_v)),
                                   seed + 9) > 0.6F;
    value *= to_tie_m < 0.02F ? (plugged ? 1.2F : 0.25F) : 0.8F;
  }
  const CellNoise pores = cellNoise(u * 9.0F, v * 9.0F, seed + 8);
  if ((pores.cell & 7U) == 0 && pores.border_distance > 0.33F) {
    value *= 0.55F;
  }
  const float nest = fractalNoise(u * 0.55F, v * 0.9F, 3, 0.7F, seed + 13);
  if (nest > 0.75F) {
    const CellNoise gravel = cellNoise(u * 30.0F, v * 30.0F, seed + 14);
    value *= 0.6F + 0.7F * unitFromBits(mixBits(gravel.cell)) * std::min(1.0F, 6.0F * gravel.border_distance);
  }
  const float warp = 0.25F * fractalNoise(u * 1.3F, v * 1.3F, 3, 0.6F, seed + 15);
  if (valueNoise(u * 0.25F, v * 0.3F, seed + 16) > 0.1F &&
      cellNoise((u + warp) * 0.55F, (v + warp) * 0.4F, seed + 17).border_distance < 0.006F) {
    value *= 0.5F;
  }
  return value;
}

}  // namespace

cv::Mat drawFormedConcrete(int width_px, int height_px, double mean, uint32_t seed) {
  cv::Mat image(height_px, width_px, CV_8UC1);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const float value = concrete(static_cast<float>(x) / static_cast<float>(kGarageTexelsPerM),
                                   static_cast<float>(y) / static_cast<float>(kGarageTexelsPerM),
                                   static_cast<float>(mean), seed);
      image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0F * value);
    }
  }
  return image;
}

cv::Mat drawGarageWall(double width_m, double height_m, const GarageWallKind& kind, uint32_t seed) {
  cv::Mat image(texels(height_m), texels(width_m), CV_8UC1);
  tbb::parallel_for(0, image.rows, [&](int y) {
    for (int x = 0; x < image.cols; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(kGarageTexelsPerM);
      const float v = static_cast<float>(image.rows - y) / static_cast<float>(kGarageTexelsPerM);
      float value = concrete(u, v, static_cast<float>(kind.tone), seed);
      if (v < kind.band_m + 0.01F * valueNoise(u * 3.0F, 0.0F, seed + 1)) {
        value *= static_cast<float>(kind.band_tone);
      }
      // Water stains from joints above and splashed dirt below.
      const float leak = valueNoise(u * 1.4F, 0.1F * v, seed + 2) + 0.5F * valueNoise(u * 6.0F, v, seed + 4);
      value *= 1.0F - 0.35F * std::clamp(2.0F * (leak - 0.55F), 0.0F, 1.0F);
      value *= 1.0F - 0.35F * std::max(0.0F, 1.0F - v / 0.35F) *
                          (0.7F + 0.3F * fractalNoise(u * 4.0F, v * 4.0F, 3, 0.7F, seed + 5));
      const float joint = std::abs(u - 5.2F * std::round(u / 5.2F));
      value *= joint < 0.015F ? 0.5F : 1.0F;
      image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0F * value);
    }
  });
  Random random(seed);
  for (double x = 1.0; x + 2.5 < width_m; x += kind.fixture_gaps * random.uniform(1.4, 3.4)) {
    drawFixture(texels(x), &random, &image);
  }
  return image;
}

cv::Mat drawGaragePillar(const std::string& name, double width_m, double height_m, uint32_t seed) {
  const int face = texels(width_m);
  const int height = texels(height_m);
  cv::Mat image = drawFormedConcrete(4 * face, height, 0.52, seed);
  Random random(seed);
  const int stripe_top = height - texels(1.0);
  const int slope = random.chance(0.5) ? 1 : -1;
  for (int y = stripe_top; y < height - texels(0.06); ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const int phase = (x + slope * y + 100 * face) / texels(0.16);
      const float u = static_cast<float>(x) * 0.1F;
      const float v = static_cast<float>(y) * 0.1F;
      const bool worn = fractalNoise(u, v, 3, 0.8F, seed + 9) > 0.75F;
      if (!worn) {
        const float dirt = 1.0F + 0.15F * fractalNoise(u, v, 3, 0.7F, seed + 11);
        image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>((phase % 2 == 0 ? 24.0F : 165.0F) * dirt);
      }
    }
  }
  for (int k = 0; k < 4; ++k) {
    cv::rectangle(image, cv::Rect(k * face + 2, height - texels(1.75), face - 4, texels(0.42)),
                  cv::Scalar(k % 2 == 0 ? 205 : 45), cv::FILLED);
    cv::putText(image, name, {k * face + 3, height - texels(1.43)}, cv::FONT_HERSHEY_DUPLEX, 0.72,
                cv::Scalar(k % 2 == 0 ? 20 : 220), 2, cv::LINE_AA);
  }
  for (int i = 0; i < 22; ++i) {
    const cv::Point from(random.index(image.cols), height - texels(1.1 * random.uniform()));
    const int length = 4 + random.index(26);
    const int drop = random.index(9) - 4;
    cv::line(image, from, {from.x + length, from.y + drop}, cv::Scalar(random.chance(0.6) ? 30 : 190), 1,
             cv::LINE_AA);
  }
  return image;
}

}  // namespace vcharge
