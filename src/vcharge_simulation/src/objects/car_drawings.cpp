#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

// Canvas in metres: x to the right, z up from the ground.
class Canvas {
 public:
  Canvas(double width_m, double height_m, double background)
      : height_m_(height_m),
        image_(static_cast<int>(std::lround(height_m * kCarTexelsPerM)),
               static_cast<int>(std::lround(width_m * kCarTexelsPerM)), CV_8UC1, gray(background)) {}

  static cv::Scalar gray(double value) { return cv::Scalar(255.0 * std::clamp(value, 0.0, 1.0)); }
  cv::Point at(double x_m, double z_m) const {
    return {static_cast<int>(std::lround(x_m * kCarTexelsPerM)),
            static_cast<int>(std::lround((height_m_ - z_m) * kCarTexelsPerM))};
  }
  void box(double x0, double z0, double x1, double z1, double value) {
    cv::rectangle(image_, at(x0, z1), at(x1, z0), gray(value), cv::FILLED);
  }
  void line(double x0, double z0, double x1, double z1, double value, int thickness = 1) {
    cv::line(image_, at(x0, z0), at(x1, z1), gray(value), thickness, cv::LINE_AA);
  }
  void ellipse(double x, double z, double half_width, double half_height, double value) {
    cv::ellipse(image_, at(x, z),
                cv::Size(static_cast<int>(half_width * kCarTexelsPerM),
                         static_cast<int>(half_height * kCarTexelsPerM)),
                0, 0, 360, gray(value), cv::FILLED, cv::LINE_AA);
  }
  // Adds dirt near the ground and returns the image.
  cv::Mat finish(uint32_t seed) {
    for (int y = 0; y < image_.rows; ++y) {
      const double z_m = height_m_ - (y + 0.5) / kCarTexelsPerM;
      const double dirt = 0.35 * std::clamp(1.0 - z_m / 0.6, 0.0, 1.0);
      for (int x = 0; x < image_.cols; ++x) {
        uint8_t& texel = image_.at<uint8_t>(y, x);
        const double noise =
            fractalNoise(static_cast<float>(x) * 0.08F, static_cast<float>(y) * 0.08F, 3, 0.6F, seed);
        const double value = texel * (1.0 - dirt) + 45.0 * dirt * (1.0 + 0.5 * noise);
        texel = cv::saturate_cast<uint8_t>(value);
      }
    }
    return image_;
  }

 private:
  double height_m_;
  cv::Mat image_;
};

double seam(double paint) {
  return paint * 0.35;
}

}  // namespace

cv::Mat drawCarSide(const CarShape& shape, double paint) {
  Canvas canvas(shape.length, shape.height, paint);
  const double rear = -shape.rear();  // x of the rear axle on the canvas
  const double pillar = rear + 0.5 * (shape.roof_front + shape.roof_rear);
  const double door_front = rear + shape.windscreen_base - 0.3;
  const double door_rear = rear + shape.wheel_radius + 0.12;
  const double low = shape.sill + 0.1;
  for (const double x : {door_front, pillar, door_rear}) {
    canvas.line(x, low, x, shape.belt_rear, seam(paint), 2);
  }
  canvas.line(door_rear, low, door_front, low, seam(paint), 2);
  canvas.box(0.0, shape.sill, shape.length, shape.sill + 0.07, 0.03);  // sill trim
  canvas.box(0.35, shape.sill + 0.28, shape.length - 0.5, shape.sill + 0.33, paint * 0.5);
  for (const double x : {pillar + 0.14, door_rear + 0.16}) {
    canvas.box(x, shape.belt_rear - 0.16, x + 0.2, shape.belt_rear - 0.13, std::max(0.03, paint * 0.5));
    canvas.line(x, shape.belt_rear - 0.125, x + 0.2, shape.belt_rear - 0.125,
                std::min(0.9, paint * 1.6 + 0.1));
  }
  canvas.ellipse(rear - 0.25, shape.belt_rear - 0.2, 0.08, 0.08, seam(paint));
  canvas.ellipse(rear - 0.25, shape.belt_rear - 0.2, 0.07, 0.07, paint);
  canvas.box(0.0, shape.belt_rear - 0.25, 0.2, shape.belt_rear - 0.05, 0.12);  // rear lamp
  canvas.box(shape.length - 0.28, shape.bonnet_front - 0.14, shape.length, shape.bonnet_front - 0.01, 0.75);
  return canvas.finish(11);
}

cv::Mat drawCarFront(const CarShape& shape, double paint) {
  Canvas canvas(shape.width, shape.height, paint);
  const double w = shape.width;
  const double top = shape.bonnet_front;
  canvas.box(0.0, 0.0, w, shape.sill + 0.1, 0.04);
  canvas.box(0.28 * w, top - 0.17, 0.72 * w, top - 0.04, 0.05);  // grille
  for (double z = top - 0.15; z < top - 0.05; z += 0.035) {
    canvas.line(0.28 * w, z, 0.72 * w, z, 0.25);
  }
  canvas.ellipse(0.5 * w, top - 0.1, 0.06, 0.06, 0.8);
  for (const double x : {0.17 * w, 0.83 * w}) {
    canvas.ellipse(x, top - 0.11, 0.16, 0.085, 0.1);
    canvas.ellipse(x, top - 0.11, 0.15, 0.075, 0.7);
    canvas.ellipse(x, top - 0.11, 0.07, 0.065, 0.95);
    canvas.ellipse(x, shape.sill + 0.17, 0.09, 0.045, 0.15);
  }
  canvas.box(0.25 * w, shape.sill + 0.1, 0.75 * w, shape.sill + 0.22, 0.04);
  canvas.line(0.05 * w, top - 0.22, 0.95 * w, top - 0.22, seam(paint), 2);
  return canvas.finish(12);
}

cv::Mat drawCarRear(const CarShape& shape, double paint) {
  Canvas canvas(shape.width, shape.height, paint);
  const double w = shape.width;
  const double top = shape.belt_rear;
  canvas.box(0.0, 0.0, w, shape.sill + 0.1, 0.04);
  for (const double x : {0.03 * w, 0.81 * w}) {
    canvas.box(x, top - 0.33, x + 0.16 * w, top - 0.06, 0.13);
    canvas.box(x + 0.02, top - 0.15, x + 0.16 * w - 0.02, top - 0.09, 0.7);
    canvas.box(x + 0.03, top - 0.3, x + 0.1 * w, top - 0.26, 0.4);
  }
  canvas.line(0.2 * w, top - 0.38, 0.8 * w, top - 0.38, seam(paint), 2);
  canvas.line(0.2 * w, top - 0.38, 0.16 * w, top, seam(paint), 2);
  canvas.line(0.8 * w, top - 0.38, 0.84 * w, top, seam(paint), 2);
  canvas.ellipse(0.5 * w, top - 0.14, 0.055, 0.055, 0.8);
  canvas.line(0.03 * w, shape.sill + 0.3, 0.97 * w, shape.sill + 0.3, seam(paint), 2);
  return canvas.finish(13);
}

cv::Mat drawWheel(uint32_t seed) {
  cv::Mat image(96, 96, CV_8UC1, cv::Scalar(10));
  const cv::Point centre(48, 48);
  cv::circle(image, centre, 47, cv::Scalar(14), 6, cv::LINE_AA);
  cv::circle(image, centre, 34, cv::Scalar(120), cv::FILLED, cv::LINE_AA);
  cv::circle(image, centre, 30, cv::Scalar(30), cv::FILLED, cv::LINE_AA);
  Random random(seed);
  const int spokes = 5 + random.index(5);
  const double phase = random.uniform(0.0, 1.0);
  for (int i = 0; i < spokes; ++i) {
    const double angle = 2.0 * CV_PI * (i + phase) / spokes;
    const cv::Point tip(centre.x + static_cast<int>(32 * std::cos(angle)),
                        centre.y + static_cast<int>(32 * std::sin(angle)));
    cv::line(image, centre, tip, cv::Scalar(140), 7 - spokes / 2, cv::LINE_AA);
  }
  cv::circle(image, centre, 7, cv::Scalar(110), cv::FILLED, cv::LINE_AA);
  return image;
}

cv::Mat drawPlate(const std::string& text) {
  cv::Mat image(44, 208, CV_8UC1, cv::Scalar(215));
  cv::rectangle(image, cv::Rect(0, 0, 208, 44), cv::Scalar(30), 2);
  cv::rectangle(image, cv::Rect(2, 2, 16, 40), cv::Scalar(60), cv::FILLED);
  cv::putText(image, text, cv::Point(24, 34), cv::FONT_HERSHEY_SIMPLEX, 1.05, cv::Scalar(20), 3, cv::LINE_AA);
  return image;
}

}  // namespace vcharge
