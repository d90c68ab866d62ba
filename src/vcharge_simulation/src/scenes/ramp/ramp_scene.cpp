#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "scenes/garage/garage_surfaces.h"
#include "scenes/lot/lot_variant.h"
#include "scenes/ramp/ramp_shape.h"
#include "scenes/ramp/ruled_surface.h"
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
constexpr int kRampCells = 300;
constexpr int kCells = kRampCells + 65;  // with those along the landing
constexpr int kCellsPerObstacle = 5;
constexpr double kLength_m = kRampLength_m + kLandingLength_m;
constexpr int kAmbientRays = 128;
constexpr double kAmbientSpacing_m = 0.5;
constexpr double kSunTexel_m = 0.04;
// The area of the lot that is cleared for the ramp.
constexpr GroundRectangle kSite{-17.0, -15.0, 14.0, 14.0};

// A place on the ramp and its landing, which continues it straight on, or on their walls: cell along the
// lane, radius, height above the lane.
struct Place {
  int cell;
  double radius_m, above_m;

  double angle() const { return kRampAngle_rad * std::min(cell, kRampCells) / kRampCells; }
  double laneHeight() const { return rampHeightAt(angle()); }
  Eigen::Vector3d position() const {
    const double straight_m = kLandingLength_m * std::max(0, cell - kRampCells) / (kCells - kRampCells);
    return {radius_m * std::cos(angle()) - straight_m * std::sin(angle()),
            radius_m * std::sin(angle()) + straight_m * std::cos(angle()), laneHeight() + above_m};
  }
  Eigen::Vector2d planar() const { return position().head<2>(); }
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
    Scene& scene = parts_.scene();
    scene.mesh.append(mesh_, Eigen::Isometry3f::Identity());
    bakeSkyLight(surfaces_, kAmbientRays, &scene);
    bakeSunMaps(surfaces_, kSunTexel_m, &scene);
  }

 private:
  using Edge = std::function<Eigen::Vector3d(int border)>;

  uint32_t concrete(double length_m, double height_m) {
    return parts_.textured(SurfaceKind::kBuilding,
                           drawFormedConcrete(static_cast<int>(length_m * kGarageTexelsPerM),
                                              static_cast<int>(height_m * kGarageTexelsPerM), 0.4,
                                              static_cast<uint32_t>(parts_.random().bits())),
                           kGarageTexelsPerM);
  }

  static Edge edge(double radius_m, double above_m) {
    return [=](int border) { return Place{border, radius_m, above_m}.position(); };
  }

  void addStrip(uint32_t material, double width_m, const Edge& low, const Edge& high) {
    const int rows = 1 + static_cast<int>(std::ceil(width_m / kAmbientSpacing_m));
    surfaces_.push_back(addRuledSurface({low, high, kCells, kLength_m, width_m, rows}, material, &mesh_));
  }

  void addLane() {
    const double width_m = 2.0 * kRampHalfWidth_m;
    const uint32_t lane =
        parts_.textured(SurfaceKind::kGround, drawLane(kLength_m, width_m, &parts_), kGarageTexelsPerM);
    addStrip(lane, width_m, edge(kOuter_m, 0.0), edge(kInner_m, 0.0));
    addStrip(concrete(kLength_m, width_m), width_m, edge(kInner_m, -kSlab_m), edge(kOuter_m, -kSlab_m));
  }

  void addParapet(double side) {
    const double lane_side_m = kRampRadius_m + side * kRampHalfWidth_m;
    const double far_side_m = lane_side_m + side * kThickness_m;
    const double height_m = kParapet_m + (side > 0.0 ? kRampSkirt_m + 0.05 : kSlab_m);
    const Edge foot = [=](int border) {
      const Place place{border, far_side_m, 0.0};
      const bool on_ground = side > 0.0 && place.laneHeight() < kRampSkirt_m;
      return Place{border, far_side_m, on_ground ? -place.laneHeight() - 0.05 : -kSlab_m}.position();
    };
    // Seen from the other side, a strip goes the other way.
    const auto add_strip = [&](double width_m, Edge low, Edge high) {
      if (side < 0.0) {
        std::swap(low, high);
      }
      addStrip(concrete(kLength_m, width_m), width_m, low, high);
    };
    const Edge top = edge(far_side_m, kParapet_m);
    const Edge lane_top = edge(lane_side_m, kParapet_m);
    const Edge lane_foot = edge(lane_side_m, 0.0);
    add_strip(kParapet_m, lane_top, lane_foot);
    add_strip(height_m, foot, top);
    add_strip(kThickness_m, top, lane_top);
    // Its lower end.
    const Eigen::Vector3f a = lane_foot(0).cast<float>();
    const Eigen::Vector3f b = Place{0, far_side_m, 0.0}.position().cast<float>();
    const Eigen::Vector3f up(0.0F, 0.0F, static_cast<float>(kParapet_m));
    const uint32_t end = concrete(kThickness_m, kParapet_m);
    if (side > 0.0) {
      addQuad(a, b, b + up, a + up, end, &mesh_);
    } else {
      addQuad(b, a, a + up, b + up, end, &mesh_);
    }
    for (int cell = 0; cell < kCells; cell += kCellsPerObstacle) {
      const int next = cell + kCellsPerObstacle;
      const double near_m = std::min(lane_side_m, far_side_m);
      const double far_m = std::max(lane_side_m, far_side_m);
      parts_.scene().obstacles.push_back(
          {"wall",
           {Place{cell, near_m, 0.0}.planar(), Place{cell, far_m, 0.0}.planar(),
            Place{next, far_m, 0.0}.planar(), Place{next, near_m, 0.0}.planar()},
           foot(cell).z(),
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

  // Its end wall and pillars; lane and parapets continue those of the ramp.
  void addLanding() {
    const double end = -kLandingLength_m;
    const double under = landingHeight() - kSlab_m;
    const double inner = kInner_m - kThickness_m;
    const double outer = kOuter_m + kThickness_m;
    addSolid("wall", {end - kThickness_m, inner, end, outer}, under, landingHeight() + kParapet_m,
             concrete(outer - inner, kParapet_m + kSlab_m));
    for (const double y : {kInner_m, kOuter_m - 0.4}) {
      addSolid("pillar", {end + 0.3, y, end + 0.7, y + 0.4}, 0.0, under, concrete(1.0, landingHeight()));
    }
  }

  // The well in the middle, with a wall like a garage's.
  void addCore() {
    constexpr int kSides = 128;
    const double top = landingHeight() + kParapet_m;
    const uint32_t wall = parts_.textured(SurfaceKind::kBuilding,
                                          drawGarageWall(kTwoPi * kCore_m, top, GarageWallKind(),
                                                         static_cast<uint32_t>(parts_.random().bits())),
                                          kGarageTexelsPerM);
    const auto circle = [](double height_m) {
      return [=](int border) {
        const double angle_rad = kTwoPi * border / kSides;
        return Eigen::Vector3d(kCore_m * std::cos(angle_rad), kCore_m * std::sin(angle_rad), height_m);
      };
    };
    const int rows = 1 + static_cast<int>(std::ceil(top / kAmbientSpacing_m));
    surfaces_.push_back(
        addRuledSurface({circle(0.0), circle(top), kSides, kTwoPi * kCore_m, top, rows}, wall, &mesh_));
    addFrustum({0.0F, 0.0F, static_cast<float>(top) - 0.02F}, {0.0F, 0.0F, static_cast<float>(top)},
               static_cast<float>(kCore_m) - 0.01F, static_cast<float>(kCore_m) - 0.01F, 64, true,
               parts_.concrete(), &mesh_);
    parts_.scene().obstacles.push_back({"wall", circleAround(0.0, 0.0, kCore_m), 0.0, top});
  }

  static constexpr double kTwoPi = 6.28318530717958647692;
  SceneParts& parts_;
  TriangleMesh mesh_;
  std::vector<LitSurface> surfaces_;
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
