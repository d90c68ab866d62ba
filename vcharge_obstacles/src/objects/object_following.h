#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "bodies/body_stereo.h"
#include "bodies/person_likeness.h"
#include "contacts/ground_contact.h"
#include "objects/object_filter.h"
#include "points/panorama.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// What one camera saw at two successive stamps.
struct TwoViews {
  const Panorama& panorama;
  const cv::Mat& before;
  const cv::Mat& now;
  RigidTransform fixed_from_vehicle_before, fixed_from_vehicle_now;
  double step_s = 0.0;
  Eigen::Vector3d camera_in_vehicle_m;
  bool is_at_rest = false;
};

/// Measures the objects that the filter expects in a camera's view, without points to follow: the bearing at
/// which the whole body is found again, and the contact with the ground below it. At rest, what is behind a
/// body stays where it is and would be found again in its place, so bodies are not searched. A bearing at
/// which nothing static can be found makes an object more probable; one that contradicts its motion, less.
/// `contact` is null if the ground was not compared.
void followObjects(const TwoViews& views, const GroundContact* contact, ObjectFilter* filter);

/// Tells the objects how much they look like a person in each view, which makes a narrow one more or less
/// probable; where one does, its bearing is that of the person. Looks are expensive: at one stamp there are
/// at most some two dozen, and the objects take turns.
void lookForPeople(const std::vector<PanoramaView>& views, const RigidTransform& fixed_from_vehicle,
                   const PersonLikeness& people, ObjectFilter* filter);

/// Measures the ranges of the objects that two cameras see at one stamp.
void followByStereo(const std::vector<PanoramaView>& views, const RigidTransform& fixed_from_vehicle,
                    ObjectFilter* filter);

}  // namespace vcharge
