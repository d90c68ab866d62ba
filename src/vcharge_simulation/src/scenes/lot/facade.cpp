#include "scenes/lot/facade.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

int texels(double metres) {
  return static_cast<int>(std::lround(metres * kFacadeTexelsPerM));
}

cv::Mat drawWall(double width_m, double height_m, bool bricks, double tone, uint32_t seed) {
  cv::Mat wall(texels(height_m), texels(width_m), CV_8UC1);
  for (int y = 0; y < wall.rows; ++y) {
    for (int x = 0; x < wall.cols; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(kFacadeTexelsPerM);
      const float v = static_cast<float>(wall.rows - y) / static_cast<float>(kFacadeTexelsPerM);
      float value =
          static_cast<float>(tone) * (1.0F + 0.10F * fractalNoise(u * 0.6F, v * 0.6F, 4, 0.6F, seed) +
                                      0.07F * fractalNoise(u * 9.0F, v * 9.0F, 2, 0.8F, seed + 7));
      if (bricks) {
        const int row = static_cast<int>(std::floor(v / 0.125F));
        const float shifted = u / 0.25F + 0.5F * static_cast<float>(row & 1);
        const int column = static_cast<int>(std::floor(shifted));
        const float edge = std::min((v / 0.125F - static_cast<float>(row)) * 0.125F,
                                    (shifted - static_cast<float>(column)) * 0.25F);
        value *= edge < 0.02F ? 1.35F : 0.75F + 0.5F * cellValue(column, row, seed + 3);
      }
      // Rain streaks and splashes above the ground.
      const float streak = std::max(0.0F, valueNoise(u * 3.0F, v * 0.25F, seed + 5));
      value *= 1.0F - 0.25F * streak - 0.3F * std::max(0.0F, 1.0F - v / 0.7F);
      wall.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0F * value);
    }
  }
  return wall;
}

void drawWindow(const cv::Rect& area, Random* random, cv::Mat* image) {
  const int glass = 12 + random->index(40);
  cv::rectangle(*image, area, cv::Scalar(glass), cv::FILLED);
  if (random->chance(0.5)) {
    const int curtain = area.width / (3 + random->index(3));
    cv::rectangle(*image, cv::Rect(area.x, area.y, curtain, area.height), cv::Scalar(100 + random->index(60)),
                  cv::FILLED);
  }
  if (random->chance(0.25)) {
    cv::rectangle(*image, cv::Rect(area.x, area.y, area.width, area.height / 2),
                  cv::Scalar(120 + random->index(50)), cv::FILLED);
  }
  const int frame = random->chance(0.7) ? 190 : 40;
  cv::rectangle(*image, area, cv::Scalar(frame), 2);
  cv::line(*image, {area.x + area.width / 2, area.y}, {area.x + area.width / 2, area.y + area.height},
           cv::Scalar(frame), 2);
  cv::rectangle(*image,
                cv::Rect(area.x - 3, area.y + area.height, area.width + 6, 4) &
                    cv::Rect(0, 0, image->cols, image->rows),
                cv::Scalar(150), cv::FILLED);
}

}  // namespace

cv::Mat drawFacade(double width_m, double height_m, const std::string& sign, uint32_t seed) {
  Random random(seed);
  const double tone = random.uniform(0.3, 0.72);
  const bool bricks = random.chance(0.4);
  cv::Mat image = drawWall(width_m, height_m, bricks, bricks ? 0.6 * tone : tone, seed);
  const double storey_m = random.uniform(2.7, 3.3);
  const double window_m = random.uniform(0.9, 1.8);
  const double pitch_m = window_m + random.uniform(0.8, 1.9);
  for (double z = 1.0; z + 1.5 < height_m; z += storey_m) {
    for (double x = 0.8; x + window_m < width_m - 0.5; x += pitch_m) {
      if (random.chance(0.9)) {
        drawWindow(cv::Rect(texels(x), texels(height_m - z - 1.4), texels(window_m), texels(1.4)), &random,
                   &image);
      }
    }
  }
  const int door_x = texels(random.uniform(0.2, 0.7) * width_m);
  cv::rectangle(image, cv::Rect(door_x, texels(height_m - 2.2), texels(1.3), texels(2.2)),
                cv::Scalar(35 + random.index(60)), cv::FILLED);
  cv::rectangle(image, cv::Rect(door_x, texels(height_m - 2.2), texels(1.3), texels(2.2)), cv::Scalar(170),
                3);
  if (!sign.empty()) {
    const double scale = 1.1;
    int baseline = 0;
    const cv::Size size = cv::getTextSize(sign, cv::FONT_HERSHEY_DUPLEX, scale, 3, &baseline);
    const cv::Point corner(std::max(4, (image.cols - size.width) / 2), texels(height_m - 2.5));
    cv::rectangle(image,
                  cv::Rect(corner.x - 8, corner.y - size.height - 8, size.width + 16, size.height + 18),
                  cv::Scalar(random.chance(0.5) ? 20 : 225), cv::FILLED);
    const bool dark = image.at<uint8_t>(corner.y + 4, corner.x) < 100;
    cv::putText(image, sign, corner, cv::FONT_HERSHEY_DUPLEX, scale, cv::Scalar(dark ? 235 : 15), 3,
                cv::LINE_AA);
  }
  cv::rectangle(image, cv::Rect(0, 0, image.cols, texels(0.3)), cv::Scalar(70), cv::FILLED);
  return image;
}

}  // namespace vcharge
