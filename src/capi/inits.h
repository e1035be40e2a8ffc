
/* The first values of the structs: camlux_camera camera = CAMLUX_CAMERA_INIT; */

#define CAMLUX_DEVICE_OPTIONS_INIT { (uint32_t)sizeof(camlux_device_options), CAMLUX_DEVICE_BEST, 0, 0, NULL }

#define CAMLUX_DEVICE_INFO_INIT { (uint32_t)sizeof(camlux_device_info), 0, CAMLUX_DEVICE_KIND_DISCRETE, 0, 0, 0, 0, \
    {0}, {0}, {0}, {0} }

#define CAMLUX_CAMERA_INIT { (uint32_t)sizeof(camlux_camera), 640, 480, CAMLUX_LENS_FOV_Y, \
    {0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {0.0, -1.0, 0.0}, 45.0, 0.0, 0.0, 0.0, 0.0 }

#define CAMLUX_SENSOR_INIT { (uint32_t)sizeof(camlux_sensor), 0, {0.0, 0.0}, 0.0, 1.0 }

#define CAMLUX_INDIRECT_INIT { (uint32_t)sizeof(camlux_indirect), CAMLUX_ESTIMATOR_FINAL_GATHER, 0, 0, 0.0, 0.0 }

#define CAMLUX_DIRECT_INIT { (uint32_t)sizeof(camlux_direct), CAMLUX_SHADOW_DEFAULT }

#define CAMLUX_POSE_INIT { (uint32_t)sizeof(camlux_pose), 0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0} }

#define CAMLUX_MATERIAL_INIT { (uint32_t)sizeof(camlux_material), CAMLUX_NONE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, -1.0, NULL }

#define CAMLUX_TEXTURE_INIT { (uint32_t)sizeof(camlux_texture), 0, 0, CAMLUX_COMPONENT_U8, 3, CAMLUX_ENCODING_DEFAULT, \
    NULL, 0, NULL }

#define CAMLUX_MESH_INIT { (uint32_t)sizeof(camlux_mesh), 0, 0, 0, \
    {NULL, 0, CAMLUX_FORMAT_F32, 0}, {NULL, 0, CAMLUX_FORMAT_F32, 0}, {NULL, 0, CAMLUX_FORMAT_F32, 0}, \
    {NULL, 0, CAMLUX_FORMAT_U32, 0}, {NULL, 0, CAMLUX_FORMAT_U32, 0}, NULL }

#define CAMLUX_LIGHT_INIT { (uint32_t)sizeof(camlux_light), CAMLUX_LIGHT_POINT, \
    {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.0, 0.0 }

#define CAMLUX_SCENE_COUNTS_INIT { (uint32_t)sizeof(camlux_scene_counts), 0, 0, 0, 0, 0 }

#define CAMLUX_BOUNDS_INIT { (uint32_t)sizeof(camlux_bounds), 0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0} }

#define CAMLUX_RENDER_OPTIONS_INIT { (uint32_t)sizeof(camlux_render_options), 500, NULL, NULL, 0, 0, NULL }

#define CAMLUX_VULKAN_DEVICE_INIT { (uint32_t)sizeof(camlux_vulkan_device), 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL }

#define CAMLUX_VULKAN_IMAGE_INIT { (uint32_t)sizeof(camlux_vulkan_image), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {0.0, 0.0, 0.0}, 1.0 }

#define CAMLUX_VIEW_INIT { (uint32_t)sizeof(camlux_view), CAMLUX_LAYER_RADIANCE, NULL, 0, 0, 0, 0, 0, CAMLUX_FORMAT_F32, \
    NULL, NULL }

#define CAMLUX_EXR_OPTIONS_INIT { (uint32_t)sizeof(camlux_exr_options), 0, 0, 0 }

#define CAMLUX_FRAME_STATS_INIT { (uint32_t)sizeof(camlux_frame_stats), 0, 0.0, 0.0, 0.0, 0, 0, 0, 0.0, 0.0, 0, 0, NULL, NULL }

#define CAMLUX_PASS_TIME_INIT { (uint32_t)sizeof(camlux_pass_time), 0, 0.0, NULL }
