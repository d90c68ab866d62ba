#include "scenes/catalogue_cases.h"

#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "scenes/scene_things.h"
#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

namespace {

constexpr double kImageScale = 0.3;
constexpr double kImagePeriod_s = 0.08;

struct Outline {
  cv::Mat_<cv::Point2f> corners;
  Eigen::AlignedBox2d box;
};

Outline outlineOf(const std::vector<Eigen::Vector2d>& footprint_m) {
  Outline outline{cv::Mat_<cv::Point2f>(static_cast<int>(footprint_m.size()), 1), Eigen::AlignedBox2d()};
  for (size_t i = 0; i < footprint_m.size(); ++i) {
    const Eigen::Vector2f corner = footprint_m[i].cast<float>();
    outline.corners(static_cast<int>(i)) = {corner.x(), corner.y()};
    outline.box.extend(footprint_m[i]);
  }
  return outline;
}

}  // namespace

const Renderer& rendererOf(const std::string& scene) {
  static std::map<std::string, Renderer> renderers;
  const auto found = renderers.find(scene);
  if (found != renderers.end()) {
    return found->second;
  }
  SceneOptions options;
  options.image_scale = kImageScale;
  options.detail = 0.25;
  return renderers.emplace(scene, buildScene(scene, options)).first->second;
}

Moment momentOf(const SceneCase& scene_case, int later_frames) {
  static std::map<std::string, SimulatedDrive> drives;
  const DrivePlan plan = planDrive(scene_case.scene, scene_case.drive);
  const std::string name = std::string(scene_case.scene) + plan.name;
  if (drives.count(name) == 0) {
    drives.emplace(name, simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1, FaultOptions(),
                                       plan.ground_height));
  }
  const int frame = scene_case.frame + later_frames;
  return {drives.at(name).world_from_vehicle.at(static_cast<size_t>(frame)).world_from_vehicle,
          plan.start_s + kImagePeriod_s * frame};
}

std::shared_ptr<const Scene> planeScene() {
  auto scene = std::make_shared<Scene>();
  Material material;
  material.kind = SurfaceKind::kGround;
  const uint32_t ground = scene->addMaterial(material);
  addQuad({-500, -500, 0}, {500, -500, 0}, {500, 500, 0}, {-500, 500, 0}, ground, &scene->mesh);
  scene->sky = std::make_unique<Sky>(LightOptions(), 1);
  return scene;
}

void expectRangesOfPlane(const CameraView& view, const RigidTransform& world_from_vehicle) {
  const cv::Mat range_m = Renderer(planeScene()).renderRange(view, world_from_vehicle);
  const RigidTransform world_from_camera = world_from_vehicle * *view.camera().vehicle_from_camera;
  int seen = 0;
  for (int y = 0; y < range_m.rows; ++y) {
    for (int x = 0; x < range_m.cols; ++x) {
      Eigen::Vector3d ray;
      if (view.centreRay(x, y).isZero() || !view.camera().model.unproject({x, y}, &ray)) {
        EXPECT_TRUE(std::isnan(range_m.at<float>(y, x)));
        continue;
      }
      const Eigen::Vector3d direction = world_from_camera.rotation() * ray;
      const double expected_m = -world_from_camera.translation().z() / direction.z();
      if (direction.z() > 0.0) {
        EXPECT_TRUE(std::isnan(range_m.at<float>(y, x)));
      } else if (expected_m < 100.0) {
        EXPECT_NEAR(range_m.at<float>(y, x), expected_m, 1e-4 * expected_m);
        ++seen;
      }
    }
  }
  EXPECT_GT(seen, 1000);
}

StandingCells findStandingCells(const Scene& scene, const TruthHeightMap& map, int border_cells) {
  cv::Mat covered = cv::Mat::zeros(map.height_m.size(), CV_8UC1);
  if (border_cells > 0) {
    cv::rectangle(covered, cv::Rect(0, 0, covered.cols, covered.rows), cv::Scalar(255), border_cells);
  }
  for (const Obstacle& obstacle : scene.obstacles) {
    std::vector<cv::Point> polygon;
    for (const Eigen::Vector2d& corner : obstacle.footprint_m) {
      const Eigen::Vector2d cell = (corner - map.origin_m) / map.cell_size_m;
      polygon.emplace_back(static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y())));
    }
    cv::fillPoly(covered, std::vector<std::vector<cv::Point>>{polygon}, cv::Scalar(255));
  }
  cv::dilate(covered, covered, cv::Mat::ones(7, 7, CV_8UC1));
  StandingCells cells;
  for (int row = 0; row < map.height_m.rows; ++row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      const Eigen::Vector2d position_m = map.origin_m + map.cell_size_m * Eigen::Vector2d(column, row);
      const double height_m = map.height_m.at<float>(row, column) - groundAt(scene, position_m);
      // Higher cells are left out: branches extend beyond the trunk that is a tree's footprint.
      if (height_m > 0.3 && height_m < 1.4) {
        ++cells.all;
        cells.unexplained += covered.at<uint8_t>(row, column) == 0 ? 1 : 0;
      }
    }
  }
  return cells;
}

double groundAt(const Scene& scene, const Eigen::Vector2d& position_m) {
  return scene.ground_height ? scene.ground_height(position_m.x(), position_m.y()) : 0.0;
}

std::set<std::string> touchedOn(const DrivePlan& plan, const std::vector<Obstacle>& obstacles) {
  constexpr double kMirror_m = 0.1;
  constexpr double kRollsOver_m = 0.02;
  const CarShape& golf = carShapes().front();
  std::vector<Outline> outlines;
  for (const Obstacle& obstacle : obstacles) {
    outlines.push_back(outlineOf(obstacle.footprint_m));
  }
  std::set<std::string> touched;
  const VehicleMotion motion(plan.path, plan.motion, 1, plan.ground_height);
  for (int ms = 0; ms < static_cast<int>(motion.duration() * 1000.0); ms += 250) {
    const RigidTransform pose = motion.at(ms).world_from_planar;
    const double height_m = motion.at(ms).worldFromVehicle().translation().z();
    const Outline own = outlineOf(orientedRectangle(pose.translation().x(), pose.translation().y(),
                                                    yawOfRotation(pose.rotation()), golf.rear(), golf.front(),
                                                    0.5 * golf.width + kMirror_m));
    for (size_t i = 0; i < outlines.size(); ++i) {
      const bool is_level =
          obstacles[i].base_z_m < height_m + golf.height && obstacles[i].top_z_m > height_m + kRollsOver_m;
      cv::Mat overlap;
      if (is_level && outlines[i].box.intersects(own.box) &&
          cv::intersectConvexConvex(outlines[i].corners, own.corners, overlap) > 0.0F) {
        const cv::Point2f corner = outlines[i].corners(0);
        touched.insert(obstacles[i].kind + " at " + std::to_string(corner.x) + ", " +
                       std::to_string(corner.y));
      }
    }
  }
  return touched;
}

Eigen::Vector2d middleOf(const Obstacle& obstacle) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : obstacle.footprint_m) {
    sum += corner;
  }
  return sum / static_cast<double>(obstacle.footprint_m.size());
}

}  // namespace vcharge
