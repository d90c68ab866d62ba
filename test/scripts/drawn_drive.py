"""A small drive whose images are drawn by a formula in seconds: a figure of eight in a room with textured walls and ground."""
import cv2
import numpy as np
import rosbag
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image

WIDTH, HEIGHT = 320, 200
FOCAL_PX, CENTRE = 96.0, (161.0, 98.5)  # equidistant: radius = focal length x angle
FIELD_OF_VIEW_RAD = 2.8
ROOM_M = ((-12.0, 14.0), (-15.0, 15.0), (0.0, 5.0))  # walls, floor and ceiling
TEXELS_PER_M, FLOOR_TEXELS_PER_M, TEXTURE = 12.0, 30.0, 1024
SOFT_TEXELS = 5.0  # pixels that see so much of a surface see no texture
FRAME_M, FRAME_S = 0.3, 0.1
ODOMETRY_PER_FRAME = 5
# name: x, y, z of the camera on the vehicle (m), yaw and downward pitch of its axis (rad)
CAMERAS = {"front": (2.9, 0.1, 0.9, 0.05, 0.45), "left": (1.5, 0.8, 1.1, 1.5, 0.5)}


def camera_rotation(yaw, down):
    """Rotation vehicle_from_camera of a camera (z forward, x right, y down) with this yaw and downward pitch."""
    forward = np.array([np.cos(yaw) * np.cos(down), np.sin(yaw) * np.cos(down), -np.sin(down)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def quaternion(rotation):
    """Quaternion x, y, z, w."""
    vector = cv2.Rodrigues(rotation)[0].ravel()
    angle = np.linalg.norm(vector)
    return [*(np.sin(angle / 2) / angle * vector), np.cos(angle / 2)]


def path(step_m):
    """Poses (x, y, yaw) every step_m along a figure of eight with gradual curvature, more than one round."""
    loop_m = 32.0
    s = np.arange(0.0, 2.0 * loop_m + 16.0, step_m)
    side = np.where((s // loop_m) % 2 == 0, 1.0, -1.0)
    curvature = side * 2.0 * np.pi / loop_m * (1.0 - 0.6 * np.cos(4.0 * np.pi * s / loop_m))  # ovals
    yaw = np.concatenate([[0.0], np.cumsum(curvature[:-1] * step_m)])
    middle = yaw + 0.5 * curvature * step_m
    x = np.concatenate([[0.0], np.cumsum(np.cos(middle[:-1]) * step_m)]) - 1.0
    y = np.concatenate([[0.0], np.cumsum(np.sin(middle[:-1]) * step_m)])
    return np.stack([x, y, yaw], axis=1)


def make_texture(seed):
    """Periodic texture of blobs of several sizes, with mean zero."""
    random = np.random.default_rng(seed)
    frequency = np.fft.fftfreq(TEXTURE)
    square = frequency[:, None] ** 2 + frequency[None, :] ** 2
    spectrum = np.fft.fft2(random.normal(size=(TEXTURE, TEXTURE)))
    image = np.zeros((TEXTURE, TEXTURE))
    for sigma, weight in ((1.5, 0.7), (3.0, 1.0), (8.0, 0.6)):
        blobs = np.fft.ifft2(spectrum * np.exp(-2.0 * (np.pi * sigma) ** 2 * square)).real
        image += weight * blobs / blobs.std()
    return (55.0 * np.tanh(image / image.std())).astype(np.float32)


def camera_rays():
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    x, y = (u - CENTRE[0]) / FOCAL_PX, (v - CENTRE[1]) / FOCAL_PX
    theta = np.hypot(x, y)
    scale = np.sinc(theta / np.pi)
    return np.stack([x * scale, y * scale, np.cos(theta)]).astype(np.float32), theta < 0.5 * FIELD_OF_VIEW_RAD


def draw(eye, rays, texture):
    """Image of the room for rays (3 x ..., in the room) from a point in it; texture too fine for the pixels is gray."""
    rays = rays + np.float32(1e-9)
    ends = [np.where(rays[i] > 0, ROOM_M[i][1] - eye[i], ROOM_M[i][0] - eye[i]).astype(np.float32) for i in range(3)]
    distances = np.stack([ends[i] / rays[i] for i in range(3)])
    distance = distances.min(axis=0)
    side = [distance == distances[i] for i in range(3)]
    point = [np.float32(eye[i]) + distance * rays[i] for i in range(3)]
    along = np.where(side[0], point[1] + 7.3, point[0]) + np.where(side[1], np.float32(31.7), 0)
    up = np.where(side[2], point[1], point[2] + 20.0) + 9.1 * np.where(side[2], rays[2] > 0, rays[0] > 0)
    incidence = np.select(side, [np.abs(rays[i]) for i in range(3)])
    footprint_m = distance / (FOCAL_PX * np.maximum(incidence, np.float32(0.02)))
    texels_per_m = np.where(side[2], np.float32(FLOOR_TEXELS_PER_M), np.float32(TEXELS_PER_M))
    columns, rows = (np.mod(texels_per_m * value, TEXTURE).astype(np.float32) for value in (along, up))
    values = cv2.remap(texture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return 128.0 + values * np.exp(-np.square(footprint_m * texels_per_m / SOFT_TEXELS))


def write_rig(file, with_extrinsics):
    lines = ["vehicle_frame: base_link", "cameras:"]
    for name, (x, y, z, yaw, down) in CAMERAS.items():
        lines += [f"  {name}:", f"    frame_id: camera_{name}_optical", f"    image_size_px: [{WIDTH}, {HEIGHT}]",
                  "    model: kannala_brandt",
                  f"    intrinsics: {{fx: {FOCAL_PX}, fy: {FOCAL_PX}, cx: {CENTRE[0]}, cy: {CENTRE[1]}, "
                  "k1: 0.0, k2: 0.0, k3: 0.0, k4: 0.0}",
                  f"    field_of_view_rad: {FIELD_OF_VIEW_RAD}"]
        if with_extrinsics:
            lines += ["    vehicle_from_camera:", f"      translation_m: [{x}, {y}, {z}]",
                      f"      rotation_xyzw: {quaternion(camera_rotation(yaw, down))}"]
    file.write_text("\n".join(lines) + "\n")


def write_bag(file, duration_fraction=1.0, knocked=None, knocked_at=0.5):
    """Images of all cameras, and odometry ten times as often. Only pixels have noise. `knocked` is like CAMERAS: where the
    cameras are after this fraction of the drive."""
    rays, inside = camera_rays()
    texture = make_texture(1)
    random = np.random.default_rng(2)
    poses = path(FRAME_M / ODOMETRY_PER_FRAME)
    poses = poses[:max(2, int(duration_fraction * len(poses)))]
    with rosbag.Bag(str(file), "w") as bag:
        for i, (x, y, yaw) in enumerate(poses):
            stamp = rospy.Time.from_sec(100.0 + i * FRAME_S / ODOMETRY_PER_FRAME)
            odometry = Odometry(child_frame_id="base_link")
            odometry.header.stamp, odometry.header.frame_id = stamp, "odom"
            odometry.pose.pose.position.x, odometry.pose.pose.position.y = x - poses[0][0], y
            odometry.pose.pose.orientation.z, odometry.pose.pose.orientation.w = np.sin(yaw / 2), np.cos(yaw / 2)
            odometry.twist.twist.linear.x = FRAME_M / FRAME_S
            bag.write("/odom", odometry, stamp)
            if i % ODOMETRY_PER_FRAME != 0:
                continue
            turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
            cameras = knocked if knocked and i > knocked_at * len(poses) else CAMERAS
            for name, (cx, cy, cz, camera_yaw, down) in cameras.items():
                room_from_camera = (turn @ camera_rotation(camera_yaw, down)).astype(np.float32)
                pixels = draw(np.array([x, y, 0.0]) + turn @ (cx, cy, cz),
                              np.tensordot(room_from_camera, rays, axes=1), texture)
                pixels = np.where(inside, pixels + random.normal(0, 1.5, pixels.shape), 0)
                image = Image(height=HEIGHT, width=WIDTH, step=WIDTH, encoding="mono8",
                              data=np.clip(np.round(pixels), 0, 255).astype(np.uint8).tobytes())
                image.header.stamp, image.header.frame_id = stamp, f"camera_{name}_optical"
                bag.write(f"/camera/{name}/image_raw", image, stamp)
