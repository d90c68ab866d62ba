#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "scenes/garage/garage_surfaces.h"
#include "scenes/lot/lot_variant.h"
#include "scenes/ramp/ramp_shape.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

constexpr double kInner_m = kRampRadius_m - kRampHalfWidth_m;
constexpr double kOuter_m = kRampRadius_m + kRampHalfWidth_m;
constexpr double kSlab_m = 0.3;
constexpr double kParapet_m = 1.0;  // height above the lane
constexpr double kThickness_m = 0.2;
constexpr double kCore_m = kInner_m - kThickness_m - 0.1;
constexpr int kCells = 300;  // along the ramp
constexpr int kCellsPerObstacle = 5;
constexpr int kAmbientRays = 48;
// The area of the lot that is cleared for the ramp.
constexpr GroundRectangle kSite{-17.0, -15.0, 14.0, 14.0};

// A place on the ramp or its walls: cell along the ramp, radius, height above the lane.
struct Place {
  int cell;
  double radius_m, above_m;

  double laneHeight() const { return rampHeightAt(kRampAngle_rad * cell / kCells); }
  Eigen::Vector2d planar() const {
    const double angle_rad = kRampAngle_rad * cell / kCells;
    return {radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad)};
  }
  Eigen::Vector3f position() const {
    const Eigen::Vector2d at = planar();
    return Eigen::Vector3d(at.x(), at.y(), laneHeight() + above_m).cast<float>();
  }
};

// Concrete with stains, tyre marks along the lane and, on its edges, painted lines.
cv::Mat drawLane(double length_m, double width_m, SceneParts* parts) {
  const auto px = [](double metres) { return static_cast<int>(std::lround(metres * kGarageTexelsPerM)); };
  cv::Mat lane =
      drawFormedConcrete(px(length_m), px(width_m), 0.3, static_cast<uint32_t>(parts->random().bits()));
  Random& random = parts->random();
  for (int i = 0; i < static_cast<int>(4.0 * length_m); ++i) {
    const cv::Point middle(px(random.uniform(0.0, length_m)), px(random.uniform(0.0, width_m)));
    const cv::Size axes(px(random.uniform(0.02, 0.3)), px(random.uniform(0.02, 0.12)));
    cv::ellipse(lane, middle, axes, random.uniform(0.0, 180.0), 0.0, 360.0,
                cv::Scalar(255.0 * random.uniform(0.1, 0.45)), cv::FILLED, cv::LINE_AA);
  }
  for (const double edge_m : {0.3, width_m - 0.3}) {
    cv::line(lane, {0, px(edge_m)}, {lane.cols, px(edge_m)}, cv::Scalar(160.0), px(0.12));
  }
  for (double along = 2.0; along < length_m; along += 6.0) {
    cv::line(lane, {px(along), px(0.5 * width_m)}, {px(along + 1.5), px(0.5 * width_m)}, cv::Scalar(150.0),
             px(0.1));
  }
  return lane;
}

class RampBuilder {
 public:
  explicit RampBuilder(SceneParts* parts) : parts_(*parts) {}

  void build() {
    addLane();
    for (const double side : {-1.0, 1.0}) {
      addParapet(side);
    }
    addLanding();
    addCore();
    bakeVertexAmbient(kAmbientRays, &mesh_);
    parts_.scene().mesh.append(mesh_, Eigen::Isometry3f::Identity());
  }

 private:
  uint32_t concrete(double length_m, double height_m) {
    return parts_.textured(SurfaceKind::kBuilding,
                           drawFormedConcrete(static_cast<int>(length_m * kGarageTexelsPerM),
                                              static_cast<int>(height_m * kGarageTexelsPerM), 0.4,
                                              static_cast<uint32_t>(parts_.random().bits())),
                           kGarageTexelsPerM);
  }

  // A strip along the ramp between two edges; seen from above or outside if `low` is on the right.
  template <class Low, class High>
  void addStrip(uint32_t material, const Low& low, const High& high) {
    for (int cell = 0; cell < kCells; ++cell) {
      const TextureWindow window{static_cast<float>(cell) / kCells, 0.0F,
                                 static_cast<float>(cell + 1) / kCells, 1.0F};
      addQuad(low(cell).position(), low(cell + 1).position(), high(cell + 1).position(),
              high(cell).position(), material, &mesh_, window);
    }
  }

  void addLane() {
    const auto edge = [](double radius_m, double above_m) {
      return [=](int cell) { return Place{cell, radius_m, above_m}; };
    };
    const uint32_t lane = parts_.textured(
        SurfaceKind::kGround, drawLane(kRampLength_m, 2.0 * kRampHalfWidth_m, &parts_), kGarageTexelsPerM);
    addStrip(lane, edge(kOuter_m, 0.0), edge(kInner_m, 0.0));
    addStrip(concrete(kRampLength_m, 2.0 * kRampHalfWidth_m), edge(kInner_m, -kSlab_m),
             edge(kOuter_m, -kSlab_m));
  }

  void addParapet(double side) {
    const double lane_side_m = kRampRadius_m + side * kRampHalfWidth_m;
    const double far_side_m = lane_side_m + side * kThickness_m;
    const auto foot = [&](int cell) {
      const Place place{cell, far_side_m, 0.0};
      const bool on_ground = side > 0.0 && place.laneHeight() < kRampSkirt_m;
      return Place{cell, far_side_m, on_ground ? -place.laneHeight() - 0.05 : -kSlab_m};
    };
    const auto at = [](double radius_m, double above_m) {
      return [=](int cell) { return Place{cell, radius_m, above_m}; };
    };
    const uint32_t wall = concrete(kRampLength_m, kParapet_m);
    const auto top = at(far_side_m, kParapet_m);
    const auto lane_top = at(lane_side_m, kParapet_m);
    const auto lane_foot = at(lane_side_m, 0.0);
    if (side > 0.0) {
      addStrip(wall, lane_top, lane_foot);
      addStrip(wall, foot, top);
      addStrip(wall, top, lane_top);
    } else {
      addStrip(wall, lane_foot, lane_top);
      addStrip(wall, top, foot);
      addStrip(wall, lane_top, top);
    }
    for (int cell = 0; cell < kCells; cell += kCellsPerObstacle) {
      const int next = cell + kCellsPerObstacle;
      const double near_m = std::min(lane_side_m, far_side_m);
      const double far_m = std::max(lane_side_m, far_side_m);
      parts_.scene().obstacles.push_back(
          {"wall",
           {Place{cell, near_m, 0.0}.planar(), Place{cell, far_m, 0.0}.planar(),
            Place{next, far_m, 0.0}.planar(), Place{next, near_m, 0.0}.planar()},
           foot(cell).position().z(),
           Place{next, 0.0, kParapet_m}.position().z()});
    }
  }

  void addSolid(const char* kind, const GroundRectangle& area, double low_m, double high_m,
                uint32_t material) {
    addBox(placement(0.5 * (area.min_x + area.max_x), 0.5 * (area.min_y + area.max_y), 0.5 * (low_m + high_m),
                     0.0),
           Eigen::Vector3d(area.width(), area.depth(), high_m - low_m).cast<float>(), material, &mesh_);
    parts_.scene().obstacles.push_back({kind, cornersOf(area), low_m, high_m});
  }

  void addLanding() {
    const double z = landingHeight();
    const uint32_t lane = parts_.textured(
        SurfaceKind::kGround, drawLane(kLandingLength_m, 2.0 * kRampHalfWidth_m, &parts_), kGarageTexelsPerM);
    const auto at = [](double x, double y, double height) {
      return Eigen::Vector3d(x, y, height).cast<float>().eval();
    };
    const double end = -kLandingLength_m;
    addQuad(at(end, kInner_m, z), at(0.0, kInner_m, z), at(0.0, kOuter_m, z), at(end, kOuter_m, z), lane,
            &mesh_);
    const double under = z - kSlab_m;
    addQuad(at(end, kOuter_m, under), at(0.0, kOuter_m, under), at(0.0, kInner_m, under),
            at(end, kInner_m, under), parts_.concrete(), &mesh_);
    const uint32_t wall = concrete(kLandingLength_m, kParapet_m);
    const double inner = kInner_m - kThickness_m;
    const double outer = kOuter_m + kThickness_m;
    addSolid("wall", {end, inner, 0.0, kInner_m}, under, z + kParapet_m, wall);
    addSolid("wall", {end, kOuter_m, 0.0, outer}, under, z + kParapet_m, wall);
    addSolid("wall", {end - kThickness_m, inner, end, outer}, under, z + kParapet_m, wall);
    for (const double y : {kInner_m, kOuter_m - 0.4}) {
      addSolid("pillar", {end + 0.3, y, end + 0.7, y + 0.4}, 0.0, under, concrete(1.0, landingHeight()));
    }
  }

  // The well in the middle, with a wall like a garage's.
  void addCore() {
    const double top = landingHeight() + kParapet_m;
    const uint32_t wall = parts_.textured(SurfaceKind::kBuilding,
                                          drawGarageWall(kTwoPi * kCore_m, top, GarageWallKind(),
                                                         static_cast<uint32_t>(parts_.random().bits())),
                                          kGarageTexelsPerM);
    addFrustum({0.0F, 0.0F, -0.05F}, {0.0F, 0.0F, static_cast<float>(top)}, static_cast<float>(kCore_m),
               static_cast<float>(kCore_m), 64, true, wall, &mesh_);
    parts_.scene().obstacles.push_back({"wall", circleAround(0.0, 0.0, kCore_m), 0.0, top});
  }

  static constexpr double kTwoPi = 6.28318530717958647692;
  SceneParts& parts_;
  TriangleMesh mesh_;
};

template <class Things, class IsOnSite>
void clear(Things* things, const IsOnSite& is_on_site) {
  things->erase(std::remove_if(things->begin(), things->end(), is_on_site), things->end());
}

LotLayout clearedLot(const SceneOptions& options) {
  LotLayout layout = makeLotLayout(options.seed, options.day);
  const auto has_place_on_site = [](const auto& thing) { return kSite.contains(thing.x, thing.y); };
  const auto has_area_on_site = [](const GroundRectangle& area) {
    return area.max_x > kSite.min_x && area.min_x < kSite.max_x && area.max_y > kSite.min_y &&
           area.min_y < kSite.max_y;
  };
  clear(&layout.cars, has_place_on_site);
  clear(&layout.trees, has_place_on_site);
  clear(&layout.bushes, has_place_on_site);
  clear(&layout.poles, has_place_on_site);
  clear(&layout.bins, has_place_on_site);
  clear(&layout.islands, has_area_on_site);
  clear(&layout.hedges, [&](const Hedge& hedge) { return has_area_on_site(hedge.area); });
  return layout;
}

}  // namespace

std::shared_ptr<const Scene> buildRampScene(const SceneOptions& options) {
  LotVariant ramp;
  ramp.layout = clearedLot(options);
  ramp.add_things = [](SceneParts* parts) {
    RampBuilder(parts).build();
    parts->scene().ground_height = rampGroundHeight;
  };
  return buildLotVariant(options, ramp);
}

}  // namespace vcharge
