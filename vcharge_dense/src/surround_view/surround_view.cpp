#include "vcharge_dense/surround_view.h"

#include <utility>

#include "surround_view/surround_renderer.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

SurroundView::SurroundView(std::shared_ptr<const CameraRig> rig, const SurroundViewOptions& options,
                           FrameCallback on_frame, const std::vector<std::string>& cameras)
    : rig_(std::move(rig)), on_frame_(std::move(on_frame)), is_used_(rig_->cameras.size(), cameras.empty()) {
  for (const std::string& name : cameras) {
    is_used_[rig_->cameraIndex(name)] = true;
  }
  renderer_ = std::make_unique<SurroundRenderer>(*rig_, options, is_used_);
  assembler_ = std::make_unique<ImageFrameAssembler>(
      is_used_.size(), options.frames,
      [this](const ImageFrame& frame) {
        renderer_->render(frame);
        on_frame_(
            {frame.stamp, renderer_->image(), renderer_->labels(), renderer_->gains(), renderer_->shading()});
      },
      [this](DriveBreak /*drive_break*/, Timestamp /*stamp*/) { renderer_->clearMemory(); }, is_used_);
  assembler_->joinStamps(rig_->stamp_tolerance_s);
}

SurroundView::~SurroundView() = default;

void SurroundView::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < is_used_.size(), "SurroundView::addImage: no such camera");
  const RigCamera& camera = rig_->cameras[camera_index];
  if (image.pixels.type() != CV_8UC1 || image.pixels.size() != camera.image_size_px) {
    throw InputError("surround view: camera " + camera.name + ": expected a gray image of " +
                     std::to_string(camera.image_size_px.width) + " x " +
                     std::to_string(camera.image_size_px.height) + " pixels, got " +
                     std::to_string(image.pixels.cols) + " x " + std::to_string(image.pixels.rows));
  }
  if (is_used_[camera_index]) {
    assembler_->addImage(camera_index, stamp, image);
  }
}

void SurroundView::addOdometry(const VehicleOdometry& odometry) {
  assembler_->addOdometry(odometry);
}

void SurroundView::setObstacles(const ObstacleMap& map) {
  if (map.frame_id == "odom") {
    renderer_->setObstacles(map);
  }
}

void SurroundView::finish() {
  assembler_->finish();
}

}  // namespace vcharge
