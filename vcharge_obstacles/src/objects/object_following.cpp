#include "objects/object_following.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "bodies/body_match.h"

namespace vcharge {
namespace {

constexpr double kMinRange_m = 0.6, kMaxRange_m = 12.0;
// Difference from the expected speed across the view up to which a body is searched, and its least
// correlation.
constexpr double kSearch_m_per_s = 1.8, kMinCorrelation = 0.6;
// Standard deviation of a bearing: legs and arms swing.
constexpr double kBearing_rad = 0.005;
// Contacts of successive images are alike: each counts as this much less certain.
constexpr double kCommonContact = 3.0;
// Half the width, and the radius, of a person.
constexpr double kHalfWidth_m = 0.15, kRadius_m = 0.25, kMaxPersonWidth_m = 1.2;
// Ranges, relative to the expected one, at which something static would have to be to pass for the object;
// the excess from which it cannot.
constexpr double kStaticRanges[] = {0.7, 1.0, 1.4};
constexpr double kMoving_rad = 0.005;
// Log-odds for an object that is seen to move, and that was measured where it is not expected.
constexpr double kMoves = 0.4, kContradicts = -0.1;
// Score from which a person's bearing is used, and its standard deviation across the view.
constexpr double kPersonScore = -0.2, kPersonAcross_m = 0.08;
// Log-odds of something no wider than a person, per score beyond that which people and other things have
// alike, and their bound: scores of successive views are alike.
constexpr double kPerScore = 0.4, kEvenScore = -0.3, kPersonVote = 0.4;
// Views of objects that are compared with people at one stamp.
constexpr int kMaxLooks = 24;

class Follower {
 public:
  Follower(const TwoViews& views, const GroundContact* contact, ObjectFilter* filter)
      : views_(views), contact_(contact), filter_(filter) {}

  void follow(const ObjectFilter::Expected& object) const {
    const Seen now = see(views_.fixed_from_vehicle_now, object.position_m);
    const Seen before =
        see(views_.fixed_from_vehicle_before, object.position_m - views_.step_s * object.velocity_m_per_s);
    if (now.bearing.range_m > kMinRange_m && now.bearing.range_m < kMaxRange_m) {
      filter_->vote(object.index, findBody(object, before, now) + findContact(object, now));
    }
  }

 private:
  struct Seen {
    BodyBearing bearing;
    Eigen::Vector2d direction;  // unit, from the camera, in the fixed frame
    Eigen::Vector2d across() const { return {-direction.y(), direction.x()}; }
  };
  Eigen::Vector2d cameraAt(const RigidTransform& fixed_from_vehicle) const {
    return (fixed_from_vehicle * views_.camera_in_vehicle_m).head<2>();
  }
  Seen see(const RigidTransform& fixed_from_vehicle, const Eigen::Vector2d& position_m) const {
    const Eigen::Vector2d from_camera = position_m - cameraAt(fixed_from_vehicle);
    const Eigen::Vector3d in_vehicle =
        fixed_from_vehicle.rotation().conjugate() * Eigen::Vector3d(from_camera.x(), from_camera.y(), 0.0);
    return {{std::atan2(in_vehicle.y(), in_vehicle.x()), from_camera.norm()}, from_camera.normalized()};
  }

  double findBody(const ObjectFilter::Expected& object, const Seen& before, const Seen& now) const {
    if (views_.is_at_rest) {
      return 0.0;
    }
    const std::optional<BodyMatch> match =
        matchBody(views_.panorama, views_.before, views_.now, before.bearing, now.bearing,
                  views_.camera_in_vehicle_m.z(), object.height_m,
                  kSearch_m_per_s * views_.step_s / now.bearing.range_m);
    if (!match || match->correlation < kMinCorrelation) {
      return 0.0;
    }
    Eigen::Vector4d row;
    row << now.across() / now.bearing.range_m - before.across() / before.bearing.range_m,
        views_.step_s / before.bearing.range_m * before.across();
    if (!filter_->correct(object.index, match->shift_rad, row, kBearing_rad)) {
      return kContradicts;
    }
    double low_rad = std::numeric_limits<double>::infinity(), high_rad = -low_rad;
    for (const double factor : kStaticRanges) {
      const Seen still =
          see(views_.fixed_from_vehicle_now, cameraAt(views_.fixed_from_vehicle_before) +
                                                 factor * before.bearing.range_m * before.direction);
      const double shift_rad =
          std::remainder(still.bearing.azimuth_rad - now.bearing.azimuth_rad, 2.0 * M_PI);
      low_rad = std::min(low_rad, shift_rad);
      high_rad = std::max(high_rad, shift_rad);
    }
    const double excess_rad = std::max(low_rad - match->shift_rad, match->shift_rad - high_rad);
    return excess_rad > kMoving_rad ? kMoves : 0.0;
  }

  double findContact(const ObjectFilter::Expected& object, const Seen& now) const {
    if (contact_ == nullptr || object.is_detected || object.width_m > kMaxPersonWidth_m) {
      return 0.0;
    }
    const double half_rad = kHalfWidth_m / now.bearing.range_m;
    const double middle_slope =
        (0.5 * object.height_m - views_.camera_in_vehicle_m.z()) / now.bearing.range_m;
    const std::optional<Contact> found =
        contact_->below(now.bearing.azimuth_rad - half_rad, now.bearing.azimuth_rad + half_rad, middle_slope);
    if (!found) {
      return 0.0;
    }
    Eigen::Vector4d row;
    row << now.direction, 0.0, 0.0;
    const double innovation_m = found->range_m + kRadius_m - now.bearing.range_m;
    return filter_->correct(object.index, innovation_m, row, kCommonContact * found->sigma_m) ? 0.0
                                                                                              : kContradicts;
  }

  const TwoViews& views_;
  const GroundContact* contact_;
  ObjectFilter* filter_;
};

struct ViewOfObject {
  double aside;  // columns from the middle of the view
  const PanoramaView* view;
  BodyBearing bearing;
};

/// The views in which an object is seen, the one first in which it is nearest to the middle.
std::vector<ViewOfObject> viewsOf(const std::vector<PanoramaView>& views,
                                  const RigidTransform& fixed_from_vehicle,
                                  const Eigen::Vector2d& fixed_position_m) {
  const Eigen::Vector2d position_m = fixed_from_vehicle.rotationMatrix().topLeftCorner<2, 2>().transpose() *
                                     (fixed_position_m - fixed_from_vehicle.translation().head<2>());
  std::vector<ViewOfObject> seen;
  for (const PanoramaView& view : views) {
    const BodyBearing bearing = bearingFrom(view.camera_in_vehicle_m.head<2>(), position_m);
    const double middle = 0.5 * (view.image.cols - 1);
    const double aside = std::abs(view.panorama.columnOf(bearing.azimuth_rad) - middle);
    if (aside < middle && bearing.range_m > kMinRange_m && bearing.range_m < kMaxRange_m) {
      seen.push_back({aside, &view, bearing});
    }
  }
  std::stable_sort(seen.begin(), seen.end(),
                   [](const ViewOfObject& a, const ViewOfObject& b) { return a.aside < b.aside; });
  return seen;
}

/// Corrects the bearing of an object that looks like a person in a view.
void correctBearing(const ObjectFilter::Expected& object, const ViewOfObject& seen, const PersonMatch& found,
                    const RigidTransform& fixed_from_vehicle, ObjectFilter* filter) {
  const Eigen::Vector2d camera_m = (fixed_from_vehicle * seen.view->camera_in_vehicle_m).head<2>();
  const Eigen::Vector2d along = (object.position_m - camera_m).normalized();
  Eigen::Vector4d row;
  row << Eigen::Vector2d(-along.y(), along.x()) / seen.bearing.range_m, 0.0, 0.0;
  filter->correct(object.index, found.shift_rad, row, kPersonAcross_m / seen.bearing.range_m);
}

}  // namespace

void followObjects(const TwoViews& views, const GroundContact* contact, ObjectFilter* filter) {
  const Follower follower(views, contact, filter);
  for (const ObjectFilter::Expected& object : filter->expected()) {
    follower.follow(object);
  }
}

void lookForPeople(const std::vector<PanoramaView>& views, const RigidTransform& fixed_from_vehicle,
                   const PersonLikeness& people, ObjectFilter* filter) {
  std::vector<ObjectFilter::Expected> objects = filter->expected();
  std::stable_sort(objects.begin(), objects.end(),
                   [](const ObjectFilter::Expected& a, const ObjectFilter::Expected& b) {
                     return a.last_look < b.last_look;
                   });
  int num_looks = 0;
  for (const ObjectFilter::Expected& object : objects) {
    double vote = 0.0;
    std::vector<double> scores;
    for (const ViewOfObject& seen : viewsOf(views, fixed_from_vehicle, object.position_m)) {
      const std::optional<PersonMatch> found = people.find(seen.view->panorama, seen.view->image,
                                                           seen.bearing, seen.view->camera_in_vehicle_m.z());
      if (!found) {
        continue;
      }
      scores.push_back(found->score);
      vote += std::clamp(kPerScore * (found->score - kEvenScore), -kPersonVote, kPersonVote);
      if (found->score > kPersonScore) {
        correctBearing(object, seen, *found, fixed_from_vehicle, filter);
      }
    }
    filter->addLook(object.index, scores, object.width_m < kMaxPersonWidth_m ? vote : 0.0);
    num_looks += static_cast<int>(scores.size());
    if (num_looks >= kMaxLooks) {
      return;
    }
  }
}

void followByStereo(const std::vector<PanoramaView>& views, const RigidTransform& fixed_from_vehicle,
                    ObjectFilter* filter) {
  for (const ObjectFilter::Expected& object : filter->expected()) {
    if (object.width_m > kMaxPersonWidth_m) {
      continue;
    }
    const std::vector<ViewOfObject> seen = viewsOf(views, fixed_from_vehicle, object.position_m);
    if (seen.size() < 2) {
      continue;
    }
    const PanoramaView& first = *seen[0].view;
    const BodyBearing expected = seen[0].bearing;
    const std::optional<StereoRange> found = matchBodyRange(first, *seen[1].view, expected, object.height_m);
    if (found) {
      const Eigen::Vector2d camera_m = (fixed_from_vehicle * first.camera_in_vehicle_m).head<2>();
      Eigen::Vector4d row;
      row << (object.position_m - camera_m).normalized(), 0.0, 0.0;
      filter->correct(object.index, found->range_m - expected.range_m, row, found->sigma_m);
    }
  }
}

}  // namespace vcharge
