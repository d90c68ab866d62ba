#include <algorithm>
#include <cmath>
#include <vector>

#include "scenes/lane_paths.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/lot/lot_variant.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

/// A rectangle that is raised between kerbs, or sunk if the height is negative.
struct Raised {
  GroundRectangle area;
  double height_m;
};

/// A bump that rises over `ramp_m` from all sides.
struct Bump {
  GroundRectangle area;
  double height_m, ramp_m;

  double heightAt(double x, double y) const {
    const double inside_m =
        std::min(std::min(x - area.min_x, area.max_x - x), std::min(y - area.min_y, area.max_y - y));
    return height_m * std::clamp(inside_m / ramp_m, 0.0, 1.0);
  }
};

// The lane is along y = 0 and 2 m wide; the last kerb lies across its end.
const std::vector<Raised> kKerbs = {{{-12.0, 2.0, -8.0, 2.8}, 0.05},   {{-6.5, 2.3, -2.5, 3.0}, 0.08},
                                    {{1.0, 2.6, 5.0, 3.6}, 0.12},      {{7.0, 3.2, 11.0, 4.0}, 0.05},
                                    {{-12.0, -3.6, -8.0, -2.8}, 0.08}, {{-6.5, -2.6, -3.0, -1.8}, 0.12},
                                    {{8.0, -2.8, 11.0, -2.0}, 0.05},   {{15.2, -2.5, 16.5, 2.5}, 0.08}};
const std::vector<Raised> kHoles = {{{0.0, -2.4, 1.0, -1.7}, -0.10}, {{3.0, -3.2, 6.0, -2.0}, -0.08}};
const std::vector<Bump> kBumps = {{{-2.2, -1.6, -0.7, 1.6}, 0.08, 0.5}, {{6.0, -1.6, 7.0, 1.6}, 0.05, 0.25}};

double stepsGroundHeight(double x_m, double y_m) {
  for (const std::vector<Raised>& areas : {kKerbs, kHoles}) {
    for (const Raised& raised : areas) {
      if (raised.area.contains(x_m, y_m)) {
        return raised.height_m;
      }
    }
  }
  double height_m = 0.0;
  for (const Bump& bump : kBumps) {
    height_m = std::max(height_m, bump.heightAt(x_m, y_m));
  }
  return height_m;
}

Eigen::Vector3f corner(double x, double y, double z) {
  return Eigen::Vector3d(x, y, z).cast<float>();
}

/// The four sides between two level rectangles of different heights, visible from above.
void addSides(const GroundRectangle& outer, double outer_z, const GroundRectangle& inner, double inner_z,
              uint32_t material, SceneParts* parts) {
  const std::vector<Eigen::Vector2d> from = cornersOf(outer), to = cornersOf(inner);
  for (size_t i = 0; i < from.size(); ++i) {
    const size_t k = (i + 1) % from.size();
    addQuad(corner(from[i].x(), from[i].y(), outer_z), corner(from[k].x(), from[k].y(), outer_z),
            corner(to[k].x(), to[k].y(), inner_z), corner(to[i].x(), to[i].y(), inner_z), material,
            &parts->scene().mesh);
  }
}

void addLevelWithHoles(uint32_t material, SceneParts* parts) {
  std::vector<double> xs = {kLotArea.min_x, kLotArea.max_x}, ys = {kLotArea.min_y, kLotArea.max_y};
  for (const Raised& hole : kHoles) {
    xs.insert(xs.end(), {hole.area.min_x, hole.area.max_x});
    ys.insert(ys.end(), {hole.area.min_y, hole.area.max_y});
  }
  std::sort(xs.begin(), xs.end());
  std::sort(ys.begin(), ys.end());
  for (size_t i = 0; i + 1 < xs.size(); ++i) {
    for (size_t k = 0; k + 1 < ys.size(); ++k) {
      const GroundRectangle cell{xs[i], ys[k], xs[i + 1], ys[k + 1]};
      if (stepsGroundHeight(0.5 * (cell.min_x + cell.max_x), 0.5 * (cell.min_y + cell.max_y)) >= 0.0) {
        parts->addLevel(cell, 0.0, material);
      }
    }
  }
}

void addGround(uint32_t material, SceneParts* parts) {
  addLevelWithHoles(material, parts);
  for (const Raised& hole : kHoles) {
    parts->addLevel(hole.area, hole.height_m, material);
    addSides(hole.area, 0.0, hole.area, hole.height_m, parts->concrete(), parts);
  }
  for (const Bump& bump : kBumps) {
    const GroundRectangle top{bump.area.min_x + bump.ramp_m, bump.area.min_y + bump.ramp_m,
                              bump.area.max_x - bump.ramp_m, bump.area.max_y - bump.ramp_m};
    parts->addLevel(top, bump.height_m, material);
    addSides(bump.area, 0.0, top, bump.height_m, material, parts);
  }
  for (const Raised& kerb : kKerbs) {
    parts->addIsland(kerb.area, material, 0.0, {kerb.height_m, false});
  }
}

LotLayout stepsLayout(const SceneOptions& options) {
  LotLayout layout = makeLotLayout(options.seed, options.day);
  layout.cars.erase(
      std::remove_if(layout.cars.begin(), layout.cars.end(),
                     [](const ParkedCar& car) { return std::abs(car.x) < 22.0 && std::abs(car.y) < 7.5; }),
      layout.cars.end());
  return layout;
}

DrivePlan pass() {
  constexpr double kCurvature_per_m = 1.0 / 40.0;
  std::vector<DrivePath::Segment> segments;
  for (const double sign : {1.0, -1.0, -1.0, 1.0}) {
    segments.push_back({3.0, 0.0, sign * kCurvature_per_m, false});
    segments.push_back({3.0, sign * kCurvature_per_m, 0.0, false});
  }
  return {"", DrivePath(RigidTransform::planar(-14.0, 0.0, 0.0), segments), fromRestToRest(2.0), 0,
          stepsGroundHeight};
}

}  // namespace

std::shared_ptr<const Scene> buildStepsScene(const SceneOptions& options) {
  LotVariant steps;
  steps.layout = stepsLayout(options);
  steps.add_ground = addGround;
  steps.ground_height = stepsGroundHeight;
  return buildLotVariant(options, steps);
}

std::vector<SceneDrive> stepsDrives() {
  return {{{"pass", "at 2 m/s past kerbs and holes, over two bumps, up to a kerb"}, pass}};
}

}  // namespace vcharge
