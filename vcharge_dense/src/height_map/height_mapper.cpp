#include "vcharge_dense/height_mapper.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <sstream>
#include <utility>

#include <tbb/task_group.h>
#include <opencv2/imgcodecs.hpp>

#include "height_map/cell_colours.h"
#include "height_map/regularization/height_regularization.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

// Ranges beyond this fraction of the farthest plane's distance may belong to any surface beyond it.
constexpr double kFarthestFraction = 0.95;
// finish() rejects a drive if a smaller ratio of its images has a pose.
constexpr double kMinCoveredImages = 0.9;
// A view counts for the path that its camera moved since the last one: thresholds of the weights' sums hold
// for views at this distance.
constexpr double kUsualDistance_m = 0.36;

std::string imagePath(const std::string& folder, const std::string& camera, Timestamp stamp) {
  return folder + "/" + camera + "/" + std::to_string(stamp.nanoseconds()) + "_image.png";
}

bool isKept(const std::string& folder, const std::string& camera, Timestamp stamp) {
  return fs::exists(folder + "/" + camera + "/" + std::to_string(stamp.nanoseconds()) + ".yaml");
}

std::string hashOf(const std::vector<std::string>& texts) {
  ContentHasher hasher;
  for (const std::string& text : texts) {
    hasher.add(text);
  }
  return hasher.hex();
}

std::string hashOf(const Trajectory& trajectory) {
  ContentHasher hasher;
  for (const StampedTransform& entry : trajectory) {
    hasher.add(entry.stamp.nanoseconds());
    const Eigen::Matrix<double, 3, 4> matrix = entry.world_from_vehicle.matrix();
    for (int i = 0; i < matrix.size(); ++i) {
      hasher.add(matrix(i));
    }
  }
  return hasher.hex();
}

}  // namespace

HeightMapper::HeightMapper(std::shared_ptr<const CameraRig> rig, const HeightMapOptions& options,
                           std::string work_folder, const std::string& drive_name)
    : rig_(std::move(rig)), options_(options), work_folder_(std::move(work_folder)), drive_name_(drive_name) {
  options_.validate();
  range_mapper_ = std::make_unique<RangeMapper>(rig_, options_.range_maps,
                                                [this](const RangeTask& task) { addTask(task); });
}

HeightMapper::~HeightMapper() {
  try {
    sweep_->wait();
  } catch (const std::exception&) {  // the caller has left because of another error
  }
}

void HeightMapper::setTrajectory(const Trajectory& map_from_vehicle, const std::string& frame_id) {
  range_mapper_->setTrajectory(map_from_vehicle);
  frame_id_ = frame_id;
  trajectory_hash_ = hashOf(map_from_vehicle);
}

void HeightMapper::checkGrid(const Trajectory& world_from_vehicle, Timestamp first, Timestamp last) const {
  Eigen::AlignedBox3d extent_m;
  for (const StampedTransform& pose : world_from_vehicle) {
    if (pose.stamp >= first && pose.stamp <= last) {
      extent_m.extend(pose.world_from_vehicle.translation());
    }
  }
  if (!extent_m.isEmpty()) {
    makeVoxelGrid(extent_m, options_.fusion);
  }
}

void HeightMapper::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  range_mapper_->addImage(camera_index, stamp, image);
}

void HeightMapper::addOdometry(const VehicleOdometry& odometry) {
  range_mapper_->addOdometry(odometry);
}

std::string HeightMapper::folder() const {
  std::ostringstream options;
  options << writeFields(options_.range_maps);
  return work_folder_ + "/" + hashOf({drive_name_, trajectory_hash_, formatCameraRig(*rig_), options.str()});
}

void HeightMapper::addTask(const RangeTask& task) {
  const Eigen::Vector3d position = task.reference.world_from_camera.translation();
  const auto last = last_position_m_.find(task.camera_index);
  double moved_m = std::max(options_.min_view_distance_m, kUsualDistance_m);
  if (last != last_position_m_.end()) {
    const double distance_m = (position - last->second).norm();
    if (distance_m < options_.min_view_distance_m) {
      return;
    }
    moved_m = std::min(distance_m, 2.0 * moved_m);
  }
  last_position_m_[task.camera_index] = position;
  const RigCamera& camera = rig_->cameras[task.camera_index];
  const RigidTransform world_from_vehicle =
      task.reference.world_from_camera * camera.vehicle_from_camera->inverse();
  extent_m_.extend(Eigen::Vector3d(position.x(), position.y(), world_from_vehicle.translation().z()));
  makeVoxelGrid(extent_m_, options_.fusion);  // rejects a grid that is too large before more range maps
  const View view{task.camera_index, task.reference.stamp, task.reference.world_from_camera,
                  moved_m / kUsualDistance_m};
  finishSweep();
  if (!drive_name_.empty() && isKept(folder(), camera.name, task.reference.stamp)) {
    ++num_reused_;
    views_.push_back(view);
  } else {
    swept_ = view;
    sweep_->run([this, task, to = folder()] { keepRangeMap(task, to); });
  }
}

void HeightMapper::finishSweep() {
  const std::optional<View> view = std::exchange(swept_, std::nullopt);
  sweep_->wait();
  if (view) {
    views_.push_back(*view);
  }
}

void HeightMapper::keepRangeMap(const RangeTask& task, const std::string& to) {
  const StageTimer timer("range maps", &times_s_);
  const std::string path = imagePath(to, rig_->cameras[task.camera_index].name, task.reference.stamp);
  createFolder(fs::path(path).parent_path().string());
  RangeMap map = range_mapper_->sweep(task);
  writeFileAtomically(path, [&](const std::string& temporary) {
    if (!cv::imwrite(temporary, map.reference)) {
      throw InputError(path + ": cannot be written (is the disk full?)");
    }
  });
  map.reference.release();  // already written as a separate image
  writeRangeMap(map, to);   // writes its YAML last, which isKept() looks for
}

RangeMap HeightMapper::readView(const View& view) const {
  return readRangeMap(folder(), rig_->cameras[view.camera_index].name, view.stamp);
}

void HeightMapper::checkCoverage() const {
  uint64_t images = 0, without_pose = 0;
  std::string reasons;
  for (const RangeMapperStatus& status : range_mapper_->status()) {
    images += status.images;
    without_pose += status.without_pose;
    reasons += (reasons.empty() ? "" : "; ") + status.camera_name + ": " + status.message;
  }
  const double covered =
      images == 0 ? 0.0 : 1.0 - static_cast<double>(without_pose) / static_cast<double>(images);
  if (images > 0 && covered < kMinCoveredImages) {
    throw InputError("poses cover " + toText(100.0 * covered, 1) + " % of the drive's " +
                     std::to_string(images) + " images, expected at least " +
                     toText(100.0 * kMinCoveredImages, 1) + " % (" + reasons + ")");
  }
  if (views_.empty()) {
    throw InputError("no range map could be made (" + (reasons.empty() ? "no image" : reasons) + ")");
  }
}

HeightMapResult HeightMapper::finish(const std::function<void(const std::string&, double)>& progress) {
  range_mapper_->finish();
  finishSweep();
  checkCoverage();
  const auto report = [&](const char* step) {
    return [&progress, step](double fraction) {
      if (progress) {
        progress(step, fraction);
      }
    };
  };
  HeightMapResult result;
  HeightMapStatistics& statistics = result.statistics;
  std::vector<Eigen::Vector3d> positions;
  for (const View& view : views_) {
    positions.push_back(view.world_from_camera.translation());
  }
  const HeightFusionOptions& fusion = options_.fusion;
  const VoxelGrid grid = makeVoxelGrid(extent_m_, fusion);
  const auto pack = [&](size_t i) {
    RangeWeighting weighting;
    weighting.view_weight = views_[i].weight;
    return std::make_shared<const PackedRangeMap>(
        packRangeMap(readView(views_[i]), views_[i].world_from_camera, weighting));
  };
  ColumnImages columns;
  {
    const StageTimer timer("fusion", &times_s_);
    columns = fuseColumns(grid, positions, pack, fusion, report("fusion"));
  }
  PrimalDualReport labelling, smoothing;
  cv::Mat observed;
  {
    const StageTimer timer("labelling", &times_s_);
    observed = labelObserved(columns, options_.label_gamma, &labelling);
  }
  statistics.num_observed = static_cast<size_t>(cv::countNonZero(observed));
  if (statistics.num_observed == 0) {
    throw InputError(
        "no cell was observed: the " + std::to_string(views_.size()) +
        " range maps have no confident range within fusion.max_range_m and the heights of the grid, " +
        toText(grid.bottom_m, 2) + " to " + toText(grid.top_m(), 2) + " m, or their poses do not overlap");
  }
  result.map.frame_id = frame_id_;
  result.map.origin_m = grid.origin_m;
  result.map.cell_size_m = grid.cell_size_m;
  {
    const StageTimer timer("smoothing", &times_s_);
    result.map.height_m = smoothHeights(columns, observed, grid, &smoothing);
  }
  result.map.confidence = columns.confidence();
  result.map.confidence.setTo(0.0F, observed == 0);
  result.map.solid = columns.solid;
  result.map.solid.setTo(0, observed);
  statistics.num_solid = static_cast<size_t>(cv::countNonZero(result.map.solid));
  result.states = classifyCells(result.map, options_.drivability);
  result.octomap =
      std::make_unique<OctomapBuilder>(options_.octomap, fusion.max_range_m,
                                       kFarthestFraction * options_.range_maps.plane_sweep.max_distance_m);
  {
    const StageTimer timer("colours and octomap", &times_s_);
    const auto show = report("colours and octomap");
    tbb::task_group rays;  // casts a view's rays while the next view is read and coloured
    result.map.gray = colourCells(
        result.map, views_.size(),
        [&](size_t i, PackedRangeMap* range, cv::Mat* image) {
          const View& view = views_[i];
          const auto map = std::make_shared<const RangeMap>(readView(view));
          rays.wait();
          rays.run([&octomap = *result.octomap, map, &view] { octomap.add(*map, view.world_from_camera); });
          *range = packRangeMap(*map, view.world_from_camera);
          const std::string path = imagePath(folder(), rig_->cameras[view.camera_index].name, view.stamp);
          *image = cv::imread(path, cv::IMREAD_GRAYSCALE);
          if (image->size() != map->range_m.size()) {
            throw InputError(path + ": expected the image of a range map");
          }
          show(static_cast<double>(i + 1) / static_cast<double>(views_.size()));
        },
        fusion.max_range_m);
    rays.wait();
  }
  statistics.num_views = views_.size();
  statistics.num_reused = num_reused_;
  statistics.label_iterations = labelling.iterations;
  statistics.height_iterations = smoothing.iterations;
  statistics.label_gap_per_cell = labelling.gap / static_cast<double>(observed.total());
  statistics.height_gap_per_cell = smoothing.gap / static_cast<double>(statistics.num_observed);
  statistics.converged = labelling.converged && smoothing.converged;
  statistics.times_s = times_s_;
  return result;
}

}  // namespace vcharge
