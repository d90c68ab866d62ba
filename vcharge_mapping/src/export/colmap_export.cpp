#include <filesystem>
#include <set>
#include <stdexcept>
#include <utility>

#include "export/text_writer.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_mapping/map_export.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

/// COLMAP's pixel (0, 0) is the corner of the first pixel, ours its centre.
constexpr double kColmapOffset_px = 0.5;

/// Replacing a folder loses what it holds: only a model may be replaced.
void requireReplaceable(const std::string& folder) {
  static const std::set<std::string> kModel = {"cameras.txt", "images.txt", "points3D.txt"};
  if (!fs::is_directory(folder)) {
    return;  // FolderTransaction looks at it
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (kModel.count(entry.path().filename().string()) == 0) {
      throw InputError(folder + ": expected a new folder or one with nothing but a COLMAP text model, has " +
                       entry.path().filename().string());
    }
  }
}

EquidistantFit fitCamera(const RigCamera& camera) {
  if (const auto* kannala_brandt = std::get_if<KannalaBrandtCamera>(&camera.model.variant())) {
    return EquidistantFit{*kannala_brandt};
  }
  try {
    return fitEquidistant(camera.model, camera.image_size_px, camera.field_of_view_rad);
  } catch (const std::invalid_argument& error) {
    throw InputError("camera " + camera.name + ": no OPENCV_FISHEYE comes near: " + error.what());
  }
}

void writeCameras(const CameraRig& rig, const std::vector<EquidistantFit>& fits, TextWriter* file) {
  file->print("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[] (fx fy cx cy k1 k2 k3 k4)\n");
  for (size_t i = 0; i < fits.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    const KannalaBrandtCamera::Parameters& p = fits[i].camera.parameters();
    file->write("# " + camera.name + ": OPENCV_FISHEYE in place of " + camera.model.name());
    file->print(", residual %.4f px rms, %.4f px at most\n", fits[i].rms_px, fits[i].max_px);
    file->print("%zu OPENCV_FISHEYE %d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", i + 1,
                camera.image_size_px.width, camera.image_size_px.height, p[0], p[1], p[2] + kColmapOffset_px,
                p[3] + kColmapOffset_px, p[4], p[5], p[6], p[7]);
  }
}

/// Where an observation stands in images.txt, and its error; image 0 where it was left out.
struct ExportedObservation {
  size_t image = 0;
  size_t point = 0;  // index within the image
  double error_px = 0.0;
};

std::vector<ExportedObservation> writeImages(const SparseMap& map, TextWriter* file, ColmapExport* result) {
  std::vector<ExportedObservation> exported(map.observations().size());
  file->print(
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "# POINTS2D[] as (X, Y, POINT3D_ID)\n");
  for (size_t keyframe = 0; keyframe < map.keyframes().size(); ++keyframe) {
    for (size_t camera = 0; camera < map.rig().cameras.size(); ++camera) {
      const auto [begin, end] = map.observationsOf(keyframe, camera);
      if (begin == end) {
        continue;
      }
      const size_t image = ++result->num_images;
      const RigCamera& rig_camera = map.rig().cameras[camera];
      const MapKeyframe& map_keyframe = map.keyframes()[keyframe];
      const RigidTransform camera_from_map =
          (map_keyframe.map_from_vehicle * *rig_camera.vehicle_from_camera).inverse();
      const Eigen::Quaterniond& q = camera_from_map.rotation();
      const Eigen::Vector3d& t = camera_from_map.translation();
      file->print("%zu %.17g %.17g %.17g %.17g %.17g %.17g %.17g %zu ", image, q.w(), q.x(), q.y(), q.z(),
                  t.x(), t.y(), t.z(), camera + 1);
      file->write(rig_camera.name + "/" + std::to_string(map_keyframe.stamp.nanoseconds()) + ".png\n");
      size_t num_points = 0;
      for (size_t i = begin; i < end; ++i) {
        const MapObservation& observation = map.observations()[i];
        const Eigen::Vector3d point_in_camera =
            camera_from_map * map.landmarks()[static_cast<size_t>(observation.landmark)].position_m;
        Eigen::Vector2d pixel;
        if (point_in_camera.z() <= 0.0 || !rig_camera.model.project(point_in_camera, &pixel)) {
          ++result->num_observations_left_out;
          continue;
        }
        exported[i] = {image, num_points++, (pixel - observation.position_px.cast<double>()).norm()};
        file->print("%s%.9g %.9g %d", num_points == 1 ? "" : " ",
                    observation.position_px.x() + kColmapOffset_px,
                    observation.position_px.y() + kColmapOffset_px, observation.landmark + 1);
      }
      file->print("\n");
      result->num_observations += num_points;
    }
  }
  return exported;
}

void writePoints(const SparseMap& map, const std::vector<ExportedObservation>& exported, TextWriter* file,
                 ColmapExport* result) {
  file->print("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n");
  for (size_t landmark = 0; landmark < map.landmarks().size(); ++landmark) {
    double sum_px = 0.0;
    size_t count = 0;
    std::string track;
    const auto [begin, end] = map.observationsOfLandmark(landmark);
    for (const int32_t* i = begin; i != end; ++i) {
      const ExportedObservation& observation = exported[static_cast<size_t>(*i)];
      if (observation.image > 0) {
        sum_px += observation.error_px;
        ++count;
        track += " " + std::to_string(observation.image) + " " + std::to_string(observation.point);
      }
    }
    if (count == 0) {
      ++result->num_points_left_out;
      continue;
    }
    ++result->num_points;
    const Eigen::Vector3d& position_m = map.landmarks()[landmark].position_m;
    file->print("%zu %.17g %.17g %.17g 160 160 160 %.6g", landmark + 1, position_m.x(), position_m.y(),
                position_m.z(), sum_px / static_cast<double>(count));
    file->write(track + "\n");
  }
}

}  // namespace

ColmapExport exportColmap(const SparseMap& map, const std::string& folder) {
  requireReplaceable(folder);
  ColmapExport result;
  for (const RigCamera& camera : map.rig().cameras) {
    result.cameras.push_back(fitCamera(camera));
  }
  FolderTransaction transaction(folder);
  const auto open = [&](const char* name) {
    return TextWriter((fs::path(transaction.path()) / name).string(), (fs::path(folder) / name).string());
  };
  TextWriter cameras = open("cameras.txt");
  writeCameras(map.rig(), result.cameras, &cameras);
  cameras.close();
  TextWriter images = open("images.txt");
  const std::vector<ExportedObservation> exported = writeImages(map, &images, &result);
  images.close();
  TextWriter points = open("points3D.txt");
  writePoints(map, exported, &points, &result);
  points.close();
  transaction.commit();
  return result;
}

}  // namespace vcharge
