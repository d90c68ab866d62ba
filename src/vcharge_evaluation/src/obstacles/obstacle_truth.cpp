#include "vcharge_evaluation/obstacle_truth.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

constexpr int64_t kKeyStride = int64_t{1} << 32;

TruthObstacle readObstacle(const YAML::Node& node) {
  TruthObstacle obstacle;
  obstacle.kind = node["kind"].as<std::string>();
  obstacle.base_z_m = node["base_z_m"].as<double>();
  obstacle.top_z_m = node["top_z_m"].as<double>();
  for (const YAML::Node& corner : node["footprint_m"]) {
    obstacle.footprint_m.emplace_back(corner[0].as<double>(), corner[1].as<double>());
  }
  if (obstacle.footprint_m.size() < 3) {
    throw InputError("footprint_m");
  }
  return obstacle;
}

Eigen::Vector3d readVector(const YAML::Node& node) {
  return {node[0].as<double>(), node[1].as<double>(), node[2].as<double>()};
}

TruthMover readMover(const YAML::Node& node, uint32_t id) {
  TruthMover mover;
  mover.obstacle = readObstacle(node);
  TrackedObject& object = mover.object;
  object.id = id;
  const std::optional<ObjectClass> object_class = objectClassOf(node["class"].as<std::string>());
  if (!object_class) {
    throw InputError("class");
  }
  object.object_class = *object_class;
  const YAML::Node rotation = node["rotation_xyzw"];
  object.frame_from_object =
      RigidTransform(Eigen::Quaterniond(rotation[3].as<double>(), rotation[0].as<double>(),
                                        rotation[1].as<double>(), rotation[2].as<double>()),
                     readVector(node["translation_m"]));
  object.velocity_m_per_s = readVector(node["velocity_m_per_s"]);
  object.is_standing = node["is_standing"].as<bool>();
  object.footprint_m = mover.obstacle.footprint_m;
  object.base_z_m = mover.obstacle.base_z_m;
  object.height_m = node["height_m"].as<double>();
  return mover;
}

}  // namespace

double TruthObstacle::width_m() const {
  double width = 0.0;
  for (const Eigen::Vector2d& a : footprint_m) {
    for (const Eigen::Vector2d& b : footprint_m) {
      width = std::max(width, (a - b).norm());
    }
  }
  return width;
}

Eigen::Vector2d TruthObstacle::middle_m() const {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : footprint_m) {
    sum += corner;
  }
  return sum / static_cast<double>(footprint_m.size());
}

std::vector<TruthObstacle> readTruthObstacles(const std::string& path) {
  const YAML::Node node = loadYamlFile(path);
  std::vector<TruthObstacle> obstacles;
  try {
    for (const YAML::Node& entry : node["obstacles"]) {
      obstacles.push_back(readObstacle(entry));
    }
  } catch (const std::exception&) {
    throw InputError(path + ": obstacles: expected kind, base_z_m, top_z_m and footprint_m of three corners");
  }
  return obstacles;
}

std::map<Timestamp, std::vector<TruthMover>> readTruthMovers(const std::string& path) {
  std::map<Timestamp, std::vector<TruthMover>> movers;
  if (!std::filesystem::exists(path)) {
    return movers;
  }
  const YAML::Node node = loadYamlFile(path);
  std::string where = "images";
  try {
    for (const YAML::Node& image : node["images"]) {
      const auto stamp_ns = image["stamp_ns"].as<int64_t>();
      where = "images: stamp_ns " + std::to_string(stamp_ns);
      auto& here = movers[Timestamp::fromNanoseconds(stamp_ns)];
      for (const YAML::Node& mover : image["movers"]) {
        here.push_back(readMover(mover, static_cast<uint32_t>(here.size() + 1)));
      }
    }
  } catch (const std::exception&) {  // from yaml-cpp, readMover or RigidTransform
    throw InputError(
        path + ": " + where +
        ": expected stamp_ns and movers, each with kind, base_z_m, top_z_m, footprint_m of three "
        "corners, class, translation_m, rotation_xyzw, velocity_m_per_s, height_m and is_standing");
  }
  return movers;
}

float TruthHeights::at(const cv::Mat& image, const Eigen::Vector2d& point_m) const {
  const int column = static_cast<int>(std::lround((point_m.x() - origin_m.x()) / cell_size_m));
  const int row = static_cast<int>(std::lround((point_m.y() - origin_m.y()) / cell_size_m));
  const bool inside = column >= 0 && row >= 0 && column < image.cols && row < image.rows;
  return inside ? image.at<float>(row, column) : 0.0F;
}

TruthHeights readTruthHeights(const std::string& yaml_path) {
  const YAML::Node node = loadYamlFile(yaml_path);
  TruthHeights heights;
  std::string file;
  try {
    file = (std::filesystem::path(yaml_path).parent_path() / node["file"].as<std::string>()).string();
    heights.origin_m = {node["origin_m"][0].as<double>(), node["origin_m"][1].as<double>()};
    heights.cell_size_m = node["cell_size_m"].as<double>();
  } catch (const YAML::Exception&) {
    throw InputError(yaml_path + ": expected file, origin_m and cell_size_m");
  }
  heights.height_m = std::filesystem::exists(file) ? cv::imread(file, cv::IMREAD_UNCHANGED) : cv::Mat();
  if (heights.height_m.type() != CV_32FC1 || heights.height_m.empty()) {
    throw InputError(file + ": expected a TIFF of 32-bit floats");
  }
  return heights;
}

std::vector<SeenPoint> makeSeenPoints(const cv::Mat& range_m, const RayTable& rays,
                                      const RigidTransform& world_from_camera,
                                      const Eigen::Vector2d& travel_in_world, int step) {
  check(range_m.type() == CV_32FC1 && range_m.size() == rays.size(),
        "makeSeenPoints: expected CV_32FC1 ranges of the camera's size");
  const Eigen::Matrix3f rotation = world_from_camera.rotationMatrix().cast<float>();
  const Eigen::Vector3f position = world_from_camera.translation().cast<float>();
  const Eigen::Vector2f travel = travel_in_world.cast<float>();
  std::vector<SeenPoint> points;
  for (int y = 0; y < range_m.rows; y += step) {
    for (int x = 0; x < range_m.cols; x += step) {
      const float range = range_m.at<float>(y, x);
      if (!std::isfinite(range) || !rays.valid(x, y)) {
        continue;
      }
      const Eigen::Vector3f offset = range * (rotation * rays.ray(x, y));
      float angle = static_cast<float>(0.5 * M_PI);  // a standing vehicle has no direction of travel
      if (travel.squaredNorm() > 0.0F) {
        const float along = std::abs(offset.head<2>().dot(travel));
        const float across = std::abs(offset.x() * travel.y() - offset.y() * travel.x());
        angle = std::atan2(across, along);
      }
      points.push_back({position + offset, angle});
    }
  }
  return points;
}

int64_t SeenCells::keyOf(const Eigen::Vector2d& point_m) {
  return static_cast<int64_t>(std::floor(point_m.y() / kCell_m)) * kKeyStride +
         static_cast<int64_t>(std::floor(point_m.x() / kCell_m));
}

Eigen::Vector2d SeenCells::middleOf(int64_t key) {
  const auto y = static_cast<int64_t>(std::floor(static_cast<double>(key + kKeyStride / 2) / kKeyStride));
  return kCell_m *
         Eigen::Vector2d(static_cast<double>(key - y * kKeyStride) + 0.5, static_cast<double>(y) + 0.5);
}

int SeenCells::countAround(const Eigen::Vector2d& point_m) const {
  int sum = 0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      const auto found = counts_.find(keyOf(point_m + kCell_m * Eigen::Vector2d(x, y)));
      sum += found == counts_.end() ? 0 : found->second;
    }
  }
  return sum;
}

}  // namespace vcharge
