#include "board_scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "lot_variant.h"
#include "ray_tracer.h"
#include "scene_parts.h"
#include "vcharge_simulation/golf_rig.h"
#include "vcharge_simulation/vehicle_body.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kColumns = 10;  // of squares
constexpr int kRows = 7;
constexpr double kSquare_m = 0.1;
constexpr double kMargin_m = 0.04;
constexpr int kTexelsPerSquare = 40;
constexpr int kPosesPerCamera = 40;
constexpr double kPose_s = 1.0;
constexpr double kMove_s = 0.4;  // of a pose's second; it is held for the rest
constexpr double kSpan_s = kPosesPerCamera * kPose_s;
constexpr double kMaxAngle_rad = 1.52;  // of a corner from the optical axis; the field of view ends at 1.61
constexpr double kMinHeight_m = 0.08;
constexpr double kFreeRadius_m = 9.0;

const RigidTransform& worldFromVehicle() {
  static const RigidTransform place = RigidTransform::planar(-5.0, 0.2, 0.1);
  return place;
}

// From the first inner corner.
double lowX() {
  return -kSquare_m - kMargin_m;
}
double highX() {
  return (kColumns - 1) * kSquare_m + kMargin_m;
}
double highY() {
  return (kRows - 1) * kSquare_m + kMargin_m;
}

std::vector<Eigen::Vector3d> placesOnBoard() {
  std::vector<Eigen::Vector3d> places;
  for (const double x : {lowX(), 0.5 * (lowX() + highX()), highX()}) {
    for (const double y : {lowX(), 0.5 * (lowX() + highY()), highY()}) {
      places.emplace_back(x, y, 0.0);
    }
  }
  return places;
}

cv::Mat drawBoard() {
  const int margin = static_cast<int>(std::lround(kMargin_m / kSquare_m * kTexelsPerSquare));
  cv::Mat image(kRows * kTexelsPerSquare + 2 * margin, kColumns * kTexelsPerSquare + 2 * margin, CV_8UC1,
                cv::Scalar(200));
  for (int row = 0; row < kRows; ++row) {
    for (int column = row % 2; column < kColumns; column += 2) {
      image(cv::Rect(margin + column * kTexelsPerSquare, margin + row * kTexelsPerSquare, kTexelsPerSquare,
                     kTexelsPerSquare))
          .setTo(cv::Scalar(12));
    }
  }
  return image;
}

// The board at a direction from the camera, facing it but for a tilt.
RigidTransform sampleBoard(double angle_rad, Random* random) {
  const double around_rad = random->uniform(0.0, 2.0 * kPi);
  const double distance_m = 0.7 * std::pow(3.0, random->uniform());
  const double roll_rad = random->uniform(-0.6, 0.6);
  const double tilt_x = random->uniform(-0.6, 0.6);
  const double tilt_y = random->uniform(-0.6, 0.6);
  const Eigen::Vector3d direction(std::sin(angle_rad) * std::cos(around_rad),
                                  std::sin(angle_rad) * std::sin(around_rad), std::cos(angle_rad));
  const Eigen::Quaterniond facing = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction);
  const Eigen::Quaterniond rotation = facing * rotationFromVector(Eigen::Vector3d(tilt_x, tilt_y, 0.0)) *
                                      rotationFromVector(Eigen::Vector3d(0.0, 0.0, roll_rad));
  const Eigen::Vector3d middle(0.5 * (lowX() + highX()), 0.5 * (lowX() + highY()), 0.0);
  return RigidTransform(rotation, distance_m * direction - rotation * middle);
}

// Whether the whole board is seen, stands free of the ground, and nothing of the car is before it.
bool isVisible(const RigidTransform& camera_from_board, const RigidTransform& vehicle_from_camera,
               const VehicleBody& body) {
  const Eigen::Vector3d& eye = vehicle_from_camera.translation();
  for (const Eigen::Vector3d& place : placesOnBoard()) {
    const Eigen::Vector3d in_camera = camera_from_board * place;
    const double angle_rad = std::atan2(in_camera.head<2>().norm(), in_camera.z());
    const Eigen::Vector3d in_vehicle = vehicle_from_camera * in_camera;
    if (angle_rad > kMaxAngle_rad || in_vehicle.z() < kMinHeight_m ||
        body.tracer().occluded(eye.cast<float>(), (in_vehicle - eye).normalized().cast<float>(),
                               static_cast<float>((in_vehicle - eye).norm() + 0.1))) {
      return false;
    }
  }
  return true;
}

// In the camera's frame, from the middle of the image to its rim in no particular order.
std::vector<RigidTransform> sampleBoards(const RigidTransform& vehicle_from_camera, const VehicleBody& body,
                                         uint64_t seed) {
  constexpr int kTries = 400;
  Random random(seed);
  std::vector<RigidTransform> boards;
  for (int i = 0; i < kPosesPerCamera; ++i) {
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const double share = (i * 17 % kPosesPerCamera + random.uniform()) / kPosesPerCamera;
      const RigidTransform board = sampleBoard(kMaxAngle_rad * std::sqrt(share), &random);
      if (isVisible(board, vehicle_from_camera, body)) {
        boards.push_back(board);
        break;
      }
    }
  }
  return boards;
}

struct BoardMotion {
  std::vector<std::string> cameras;
  std::vector<std::vector<RigidTransform>> world_from_board;  // of each camera, one after the other

  RigidTransform at(double time_s) const {
    const double in_range_s = std::clamp(time_s, 0.0, kSpan_s * static_cast<double>(cameras.size()) - 1e-6);
    const auto camera = static_cast<size_t>(in_range_s / kSpan_s);
    const double in_span_s = in_range_s - static_cast<double>(camera) * kSpan_s;
    const std::vector<RigidTransform>& boards = world_from_board[camera];
    const auto index = static_cast<size_t>(in_span_s / kPose_s);
    const RigidTransform& here = boards[index % boards.size()];
    const RigidTransform& next = boards[(index + 1) % boards.size()];
    const double held_s = kPose_s - kMove_s;
    const double share = (in_span_s - static_cast<double>(index) * kPose_s - held_s) / kMove_s;
    if (share <= 0.0) {
      return here;
    }
    const double eased = share * share * (3.0 - 2.0 * share);
    return RigidTransform(here.rotation().slerp(eased, next.rotation()),
                          here.translation() + eased * (next.translation() - here.translation()));
  }
};

BoardMotion moveBoard(uint64_t seed) {
  const auto body = makeGolfBody();
  BoardMotion motion;
  uint64_t number = 0;
  for (const RigCamera& camera : makeGolfRig(1, 1.0).cameras) {
    motion.cameras.push_back(camera.name);
    std::vector<RigidTransform> boards =
        sampleBoards(*camera.vehicle_from_camera, *body, seed * 10U + number++);
    if (boards.empty()) {
      throw std::logic_error("moveBoard: no board is visible to the camera " + camera.name);
    }
    for (RigidTransform& board : boards) {
      board = worldFromVehicle() * *camera.vehicle_from_camera * board;
    }
    motion.world_from_board.push_back(std::move(boards));
  }
  return motion;
}

MoverState boardAt(const BoardMotion& motion, uint32_t front, uint32_t back, double time_s) {
  MoverState state;
  state.world_from_mover = motion.at(time_s);
  const auto corner = [&](double x, double y, double z) {
    return (state.world_from_mover * Eigen::Vector3d(x, y, z)).cast<float>().eval();
  };
  constexpr double kThickness_m = 0.01;
  // The viewer is at negative z, and image rows grow with y.
  addQuad(corner(lowX(), highY(), 0.0), corner(highX(), highY(), 0.0), corner(highX(), lowX(), 0.0),
          corner(lowX(), lowX(), 0.0), front, &state.mesh);
  addQuad(corner(highX(), highY(), kThickness_m), corner(lowX(), highY(), kThickness_m),
          corner(lowX(), lowX(), kThickness_m), corner(highX(), lowX(), kThickness_m), back, &state.mesh);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& place : placesOnBoard()) {
    box.extend(state.world_from_mover * place);
  }
  state.obstacle = {"board", cornersOf({box.min().x(), box.min().y(), box.max().x(), box.max().y()}),
                    box.min().z(), box.max().z()};
  return state;
}

}  // namespace

std::shared_ptr<const Scene> buildBoardScene(const SceneOptions& options) {
  LotVariant variant;
  variant.layout = makeLotLayout(static_cast<uint64_t>(options.seed), options.day, options.moved_cars);
  // No car stands where the board is held.
  const Eigen::Vector2d place = worldFromVehicle().translation().head<2>();
  variant.layout.cars.erase(std::remove_if(variant.layout.cars.begin(), variant.layout.cars.end(),
                                           [&](const ParkedCar& car) {
                                             return (Eigen::Vector2d(car.x, car.y) - place).norm() <
                                                    kFreeRadius_m;
                                           }),
                            variant.layout.cars.end());
  const auto motion = std::make_shared<const BoardMotion>(moveBoard(static_cast<uint64_t>(options.seed)));
  variant.add_things = [motion](SceneParts* parts) {
    const uint32_t front = parts->textured(SurfaceKind::kOther, drawBoard(), kTexelsPerSquare / kSquare_m);
    const uint32_t back = parts->plain(SurfaceKind::kOther, 0.3);
    parts->scene().movers.push_back(
        {"board", [motion, front, back](double time_s) { return boardAt(*motion, front, back, time_s); }});
  };
  return buildLotVariant(lotOptionsOf(options), variant);
}

std::vector<CatalogueEntry> listBoardDrives() {
  std::vector<CatalogueEntry> drives;
  for (const char* camera : {"front", "left", "rear", "right"}) {
    const std::string name(camera);
    drives.push_back({"board_" + name, "the car stands; 40 s of the board before the camera " + name});
  }
  return drives;
}

DrivePlan planBoardDrive(const std::string& name) {
  const std::vector<CatalogueEntry> drives = listBoardDrives();
  const auto found = std::find_if(drives.begin(), drives.end(),
                                  [&](const CatalogueEntry& entry) { return entry.name == name; });
  if (found == drives.end()) {
    throw std::invalid_argument("drive: the scene chessboard has none of the name '" + name + "'");
  }
  VehicleMotionOptions motion;
  motion.standstill_s = motion.duration_s = kSpan_s;
  return {name,    DrivePath(worldFromVehicle(), {{1.0, 0.0, 0.0}}),     motion, 0,
          nullptr, kSpan_s * static_cast<double>(found - drives.begin())};
}

}  // namespace vcharge
