#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_simulation/rendering/mesh.h"

namespace vcharge {

/// Shape of a car in its vehicle frame: x forward, the origin on the ground under the centre of the rear
/// axle. Metres.
struct CarShape {
  std::string name;
  double length = 4.2, width = 1.77, height = 1.48;
  double wheelbase = 2.58, front_overhang = 0.88;
  double wheel_radius = 0.31;
  double sill = 0.2;  ///< height of the lower edge of the body
  double bonnet_front =
      0.68;  ///< height of the body's upper edge at the front end, at the windscreen and at the rear
  double bonnet_rear = 0.93;
  double belt_rear = 0.98;
  double windscreen_base = 2.15;  ///< x of the lower and upper edge of the windscreen and of the upper and
                                  ///< lower edge of the rear window
  double roof_front = 1.45;
  double roof_rear = -0.35;
  double rear_window_base = -0.68;
  double rear_pillar = 0.25;  ///< width of the rearmost pillar

  double front() const { return wheelbase + front_overhang; }
  double rear() const { return front() - length; }
};

/// Hatchback (the first one, a VW Golf), saloon, estate, van, small car and off-roader.
const std::vector<CarShape>& carShapes();

/// Materials of a car, as indices into Scene::materials.
struct CarMaterials {
  uint32_t paint, side, front, rear, glass, trim, tyre, wheel, plate;
};

/// Closed mesh of a car, optionally with mirrors and number plates.
TriangleMesh makeCarMesh(const CarShape& shape, const CarMaterials& materials, bool with_mirrors_and_plates);

/// Texels per metre of the images drawn below.
inline constexpr double kCarTexelsPerM = 100.0;
/// Reflectance (CV_8UC1) of the side (length x height), the front and the rear (width x height) of a car,
/// with lamps, seams and handles.
cv::Mat drawCarSide(const CarShape& shape, double paint);
cv::Mat drawCarFront(const CarShape& shape, double paint);
cv::Mat drawCarRear(const CarShape& shape, double paint);
/// Images of a wheel seen from outside and of a number plate.
cv::Mat drawWheel(uint32_t seed);
cv::Mat drawPlate(const std::string& text);

}  // namespace vcharge
