#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "detection/pixel_rays.h"
#include "ground/point_warp.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_obstacles/ground_plane.h"

namespace vcharge {

/// An image of a camera, smoothed, and the pose of the tilted body over level ground when it was taken.
struct GroundView {
  GroundView(Timestamp time, const cv::Mat& image, const RigidTransform& fixed_from_body);

  Timestamp stamp;
  RigidTransform fixed_from_body;
  cv::Mat smooth;           ///< CV_8UC1
  cv::Mat lowest, highest;  ///< extremes of `smooth` within the tolerated error of the warp
};

/// A pixel of the newer of two images, compared with the same ground in the older one.
struct MatchedPixel {
  size_t ray;                      ///< index in PixelRays
  float from_inverse, to_inverse;  ///< strip of ground that the pixel covers, as inverse ranges
  bool is_ground;                  ///< fits the ground, and fits a plane above the ground worse
  bool is_other;                   ///< fits the plane above better, or neither
  bool is_changed;                 ///< not the brightness of the ground, nor the ground in other light
  bool keeps_texture;              ///< its surroundings have the texture of the ground
  float unexplained;  ///< part of the difference that a reflection does not explain; 1 if none was sought
};

/// Compares two images of a camera by the plane of the ground: the older one is warped as if all pixels
/// showed the ground, and again as if they showed a plane kRaised_m above it. Where the image moves along its
/// own texture, as on a pole straight ahead, both fit and nothing is decided.
class GroundMatch {
 public:
  enum class Wanted {
    kChanges,  ///< MatchedPixel::is_changed only, for a fraction of the time
    kAll,
  };
  enum class Reflections {
    kIgnored,
    kSought,  ///< for pixels that changed or are other
  };
  /// Height of the plane that stands for obstacles; the decision falls halfway.
  static constexpr double kRaised_m = 0.2;

  /// `rays` must outlive it. `min_difference`: gray levels by which changed ground differs.
  GroundMatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, const PixelRays& rays,
              double min_difference);

  /// Where the rays of the pixels meet the ground.
  struct Ground {
    float height_m = 0.0F;             ///< of the camera above it
    std::vector<float> inverse_per_m;  ///< by ray: inverse horizontal range; not positive above the horizon
  };
  Ground meet(const GroundPlane& plane) const;
  /// Pixels whose ground lies between two ranges from the camera; none if the exposures cannot be compared.
  std::vector<MatchedPixel> compare(const GroundView& now, const GroundView& before, const Ground& ground,
                                    double near_m, double far_m, Wanted wanted,
                                    Reflections reflections) const;

 private:
  struct Band;
  struct Compared;

  Band pixelsIn(const Ground& ground, double near_m, double far_m) const;
  void seekReflections(const GroundView& now, const GroundView& before, const Band& band,
                       const Compared& compared, std::vector<MatchedPixel>* pixels) const;

  const RigidTransform vehicle_from_camera_;
  const cv::Size size_;
  const PixelRays& rays_;
  const float min_difference_;
  const PointWarp warp_;
};

}  // namespace vcharge
