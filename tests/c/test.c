/*
 * A small host of camlux in portable C: compiled as C99, C++17 and C++20, and against the header of version 1.
 *
 *     test            checks what it renders, every kind of error, and that nothing is left
 *     test cycles N   creates, renders and releases N times, and checks that memory does not grow
 */
#include <camlux.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#ifndef CAMLUX_TEST_OLD_HEADER
#include "layout.h"
#endif

#define SIZE_PX 16

static int failures = 0;

static void check_at(int line, int is_so, const char *what)
{
    if (!is_so) {
        fprintf(stderr, "test.c:%d: %s (%s)\n", line, what, camlux_last_error());
        failures++;
    }
}

#define EXPECT(is_so) check_at(__LINE__, (is_so) != 0, #is_so)
#define OK(call) check_at(__LINE__, (call) == CAMLUX_OK, #call)

static void check_inits(void)
{
#ifndef CAMLUX_TEST_OLD_HEADER
    size_t i;
    for (i = 0; i < sizeof inits / sizeof inits[0]; i++)
        if (memcmp(inits[i].of_rust, inits[i].of_c, inits[i].bytes) != 0) {
            fprintf(stderr, "%s_INIT differs from the library's\n", inits[i].name);
            failures++;
        }
#endif
}

/* Every status has a text of its own. */
static void check_status_texts(void)
{
#ifndef CAMLUX_TEST_OLD_HEADER
    const size_t count = sizeof statuses / sizeof statuses[0];
    size_t i, j;
    EXPECT(count >= 13);
    for (i = 0; i < count; i++) {
        const char *text = camlux_status_text(statuses[i]);
        EXPECT(text[0] != 0 && strcmp(text, "unknown status") != 0);
        for (j = 0; j < i; j++)
            EXPECT(strcmp(text, camlux_status_text(statuses[j])) != 0);
    }
#endif
    EXPECT(strcmp(camlux_status_text(CAMLUX_CANCELLED), "cancelled") == 0);
    EXPECT(strcmp(camlux_status_text(77), "unknown status") == 0);
}

/* A vertex as a simulator may have it. */
struct vertex {
    unsigned char tag[4];
    float position_m[3];
};

static uint32_t add_quad(camlux_scene *scene, const struct vertex *corners, uint32_t material)
{
    static const uint16_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
    camlux_mesh mesh = CAMLUX_MESH_INIT;
    uint32_t index = UINT32_MAX, instance = UINT32_MAX;
    mesh.material = material;
    mesh.vertex_count = 4;
    mesh.positions_m.data = corners[0].position_m;
    mesh.positions_m.stride_bytes = sizeof corners[0];
    mesh.triangle_count = 2;
    mesh.indices.data = triangles;
    mesh.indices.format = CAMLUX_FORMAT_U16;
    mesh.name = "quad";
    OK(camlux_scene_add_mesh(scene, &mesh, &index));
    OK(camlux_scene_add_instance(scene, index, NULL, &instance));
    return instance;
}

/* A box of 2 m, open to the front, with a red and a green wall, and a lamp in the middle. */
static camlux_scene *make_box(int with_indirect)
{
    static const struct vertex floor_m[4] = {
        {{0}, {-1, -1, -1}}, {{0}, {-1, -1, 1}}, {{0}, {1, -1, 1}}, {{0}, {1, -1, -1}}};
    static const struct vertex ceiling_m[4] = {
        {{0}, {-1, 1, -1}}, {{0}, {1, 1, -1}}, {{0}, {1, 1, 1}}, {{0}, {-1, 1, 1}}};
    static const struct vertex back_m[4] = {
        {{0}, {-1, -1, -1}}, {{0}, {1, -1, -1}}, {{0}, {1, 1, -1}}, {{0}, {-1, 1, -1}}};
    static const struct vertex left_m[4] = {
        {{0}, {-1, -1, -1}}, {{0}, {-1, 1, -1}}, {{0}, {-1, 1, 1}}, {{0}, {-1, -1, 1}}};
    static const struct vertex right_m[4] = {
        {{0}, {1, -1, -1}}, {{0}, {1, -1, 1}}, {{0}, {1, 1, 1}}, {{0}, {1, 1, -1}}};
    static const double colors[3][3] = {{0.75, 0.75, 0.75}, {0.75, 0.1, 0.1}, {0.1, 0.75, 0.1}};
    camlux_scene *scene = NULL;
    camlux_camera camera = CAMLUX_CAMERA_INIT;
    camlux_light lamp = CAMLUX_LIGHT_INIT;
    camlux_indirect indirect = CAMLUX_INDIRECT_INIT;
    int i;

    OK(camlux_scene_create(&scene));
    camera.width_px = SIZE_PX;
    camera.height_px = SIZE_PX;
    camera.position_m[2] = 3.5;
    camera.look_at_m[2] = 0;
    camera.up[1] = 1;
    OK(camlux_scene_set_camera(scene, &camera));
    lamp.power_w[0] = lamp.power_w[1] = lamp.power_w[2] = 40;
    OK(camlux_scene_add_light(scene, &lamp, NULL));
    indirect.estimator = CAMLUX_ESTIMATOR_INSTANT_RADIOSITY;
    indirect.rsm_size = 8;
    OK(camlux_scene_set_indirect(scene, with_indirect ? &indirect : NULL));
    for (i = 0; i < 3; i++) {
        camlux_material material = CAMLUX_MATERIAL_INIT;
        uint32_t index = UINT32_MAX;
        memcpy(material.kd, colors[i], sizeof material.kd);
        OK(camlux_scene_add_material(scene, &material, &index));
        EXPECT(index == (uint32_t)i);
    }
    EXPECT(add_quad(scene, floor_m, 0) == 0);
    EXPECT(add_quad(scene, ceiling_m, 0) == 1);
    EXPECT(add_quad(scene, back_m, 0) == 2);
    EXPECT(add_quad(scene, left_m, 1) == 3);
    EXPECT(add_quad(scene, right_m, 2) == 4);
    return scene;
}

static const float *values_of(camlux_frame *frame, int32_t layer)
{
    camlux_view view = CAMLUX_VIEW_INIT;
    OK(camlux_frame_view(frame, layer, &view));
    EXPECT(view.width_px == SIZE_PX && view.height_px == SIZE_PX && view.format == CAMLUX_FORMAT_F32);
    EXPECT(view.size_bytes == (size_t)SIZE_PX * SIZE_PX * view.channels * sizeof(float));
    return (const float *)view.data;
}

static void check_values(camlux_frame *frame)
{
    const double pi = 3.14159265358979323846;
    const float *direct = values_of(frame, CAMLUX_LAYER_DIRECT);
    const float *indirect = values_of(frame, CAMLUX_LAYER_INDIRECT);
    const float *radiance = values_of(frame, CAMLUX_LAYER_RADIANCE);
    const float *position_m = values_of(frame, CAMLUX_LAYER_POSITION);
    const float *depth_m = values_of(frame, CAMLUX_LAYER_DEPTH);
    float copied[3 * SIZE_PX * SIZE_PX];
    camlux_view ids = CAMLUX_VIEW_INIT;
    size_t pixel = SIZE_PX * (SIZE_PX / 2) + SIZE_PX / 2, i;
    double x, y, d2, expected;

    OK(camlux_frame_view(frame, CAMLUX_LAYER_INSTANCE_ID, &ids));
    EXPECT(ids.format == CAMLUX_FORMAT_U32 && ids.channels == 1 && strcmp(ids.name, "id.instance") == 0);
    EXPECT(((const uint32_t *)ids.data)[pixel] == 3);
    EXPECT(((const uint32_t *)ids.data)[SIZE_PX * (SIZE_PX / 2)] == 4);
    EXPECT(fabs(depth_m[pixel] - 4.5) < 1e-5);
    /* The lamp, 1 m before the back wall: E = I cos / d^2, L = kd/pi E. */
    x = position_m[3 * pixel];
    y = position_m[3 * pixel + 1];
    d2 = x * x + y * y + 1;
    expected = 0.75 / pi * 40 / (4 * pi) / (d2 * sqrt(d2));
    EXPECT(fabs(direct[3 * pixel] - expected) < 1e-5 * expected);
    EXPECT(indirect[3 * pixel] > 0.01F * direct[3 * pixel]);
    for (i = 0; i < 3 * SIZE_PX * SIZE_PX; i++)
        EXPECT(fabsf(radiance[i] - (direct[i] + indirect[i])) <= 1e-6F * radiance[i]);
    /* Red light comes from the left, green light from the right. */
    EXPECT(indirect[3 * (pixel - 4)] > indirect[3 * (pixel - 4) + 1]);
    EXPECT(indirect[3 * (pixel + 4)] < indirect[3 * (pixel + 4) + 1]);
    OK(camlux_frame_copy(frame, CAMLUX_LAYER_RADIANCE, copied, sizeof copied, 0));
    EXPECT(memcmp(copied, radiance, sizeof copied) == 0);
}

static int has_pass(camlux_frame *frame, const char *name)
{
    camlux_frame_stats stats = CAMLUX_FRAME_STATS_INIT;
    uint32_t i;
    OK(camlux_frame_get_stats(frame, &stats));
    EXPECT(stats.wall_ms > 0 && stats.vpl_count > 0 && stats.device[0] != 0);
    for (i = 0; i < stats.pass_count; i++) {
        camlux_pass_time pass = CAMLUX_PASS_TIME_INIT;
        OK(camlux_frame_get_pass(frame, i, &pass));
        if (strcmp(pass.name, name) == 0)
            return 1;
    }
    return 0;
}

static int32_t count_reports(double fraction, const char *pass, void *user)
{
    EXPECT(fraction >= 0 && fraction <= 1 && pass[0] != 0);
    ++*(int *)user;
    return 0;
}

static int32_t stop(double fraction, const char *pass, void *user)
{
    (void)fraction, (void)pass, (void)user;
    return 1;
}

static void count_messages(int32_t level, const char *message, void *user)
{
    EXPECT(level >= CAMLUX_LOG_ERROR && level <= CAMLUX_LOG_DEBUG && message[0] != 0);
    ++*(int *)user;
}

static void check_errors(camlux_scene *scene, camlux_renderer *renderer)
{
    camlux_camera camera = CAMLUX_CAMERA_INIT;
    camlux_indirect sum = CAMLUX_INDIRECT_INIT;
    camlux_pose pose = CAMLUX_POSE_INIT;
    camlux_frame *frame = NULL;
    camlux_render_options options = CAMLUX_RENDER_OPTIONS_INIT;
    camlux_cancel_token *token = NULL;
    /* Larger than the struct of the current library, with either header. */
    struct { camlux_camera camera; uint64_t added[64]; } newer = {CAMLUX_CAMERA_INIT, {0}};
    int on_stack = 0;

    EXPECT(camlux_scene_set_camera(NULL, &camera) == CAMLUX_ERROR_INVALID_HANDLE);
    EXPECT(strstr(camlux_last_error(), "NULL") != NULL);
    EXPECT(camlux_scene_set_camera((camlux_scene *)(void *)renderer, &camera) == CAMLUX_ERROR_INVALID_HANDLE);
    EXPECT(strstr(camlux_last_error(), "is a camlux_renderer") != NULL);
    EXPECT(camlux_scene_set_camera((camlux_scene *)(void *)&on_stack, &camera) == CAMLUX_ERROR_INVALID_HANDLE);
    EXPECT(camlux_scene_set_camera(scene, NULL) == CAMLUX_ERROR_INVALID_ARGUMENT);
    camera.struct_size = 3;
    EXPECT(camlux_scene_set_camera(scene, &camera) == CAMLUX_ERROR_INVALID_ARGUMENT);
    EXPECT(strstr(camlux_last_error(), "CAMLUX_CAMERA_INIT") != NULL);
    newer.camera.struct_size = CAMLUX_INITIALISED + (uint32_t)sizeof newer;
    newer.added[63] = 1;
    EXPECT(camlux_scene_set_camera(scene, &newer.camera) == CAMLUX_ERROR_INVALID_ARGUMENT);
    EXPECT(strstr(camlux_last_error(), "newer") != NULL);
    camera.struct_size = (uint32_t)sizeof camera;
    EXPECT(camlux_scene_set_camera(scene, &camera) == CAMLUX_ERROR_INVALID_ARGUMENT);
    EXPECT(strstr(camlux_last_error(), "not initialised") != NULL);
    camera.struct_size += CAMLUX_INITIALISED;
    camera.fov_y_deg = -1;
    EXPECT(camlux_scene_set_camera(scene, &camera) == CAMLUX_ERROR_SCENE);
    sum.estimator = CAMLUX_ESTIMATOR_INSTANT_RADIOSITY;
    sum.rsm_size = 8;
    sum.target_error = 0.05;
    EXPECT(camlux_scene_set_indirect(scene, &sum) == CAMLUX_ERROR_SCENE);
    EXPECT(strstr(camlux_last_error(), "target_error is 0.05") != NULL);
    sum.target_error = 0;
    sum.max_rays = UINT64_C(5000000000);
    EXPECT(camlux_scene_set_indirect(scene, &sum) == CAMLUX_ERROR_SCENE);
    EXPECT(strstr(camlux_last_error(), "max_rays is 5000000000") != NULL);
    pose.orientation_xyzw[3] = 2;
    EXPECT(camlux_scene_set_pose(scene, CAMLUX_PART_LIGHT, 0, &pose) == CAMLUX_ERROR_SCENE);
    options.progress = stop;
    EXPECT(camlux_renderer_render(renderer, scene, &options, &frame) == CAMLUX_CANCELLED);
    EXPECT(frame == NULL);
    options.progress = NULL;
    OK(camlux_cancel_token_create(&token));
    OK(camlux_cancel_token_cancel(token));
    options.cancel_token = token;
    EXPECT(camlux_renderer_render(renderer, scene, &options, &frame) == CAMLUX_CANCELLED);
    EXPECT(frame == NULL);
    OK(camlux_cancel_token_release(token));
}

static void check_everything(void)
{
    camlux_device *device = NULL;
    camlux_renderer *renderer = NULL;
    camlux_frame *frames[3] = {NULL, NULL, NULL};
    camlux_scene *scene = make_box(1);
    camlux_device_info info = CAMLUX_DEVICE_INFO_INIT;
    camlux_bounds bounds = CAMLUX_BOUNDS_INIT;
    camlux_scene_counts counts = CAMLUX_SCENE_COUNTS_INIT;
    camlux_render_options options = CAMLUX_RENDER_OPTIONS_INIT;
    camlux_pose pose = CAMLUX_POSE_INIT;
    int reports = 0, messages = 0;
    uint32_t left = 1;

    check_inits();
    check_status_texts();
    EXPECT(camlux_version() / 1000000 == CAMLUX_VERSION_MAJOR);
    OK(camlux_set_log(CAMLUX_LOG_INFO, count_messages, &messages));
    OK(camlux_device_create(NULL, &device));
    EXPECT(messages == 1);
    OK(camlux_device_info_of(device, &info));
    EXPECT(info.is_usable == 1 && info.name[0] != 0 && info.lacks[0] == 0);
    OK(camlux_scene_get_counts(scene, &counts));
    EXPECT(counts.meshes == 5 && counts.instances == 5 && counts.materials == 3 && counts.lights == 1);
    OK(camlux_scene_get_bounds(scene, &bounds));
    EXPECT(bounds.is_empty == 0 && bounds.min_m[0] == -1 && bounds.max_m[1] == 1);
    OK(camlux_renderer_create(device, &renderer));
    /* The renderer keeps the device open. */
    OK(camlux_device_release(device));
    EXPECT(camlux_device_release(device) == CAMLUX_ERROR_INVALID_HANDLE);

    options.progress = count_reports;
    options.progress_user = &reports;
    OK(camlux_renderer_render(renderer, scene, &options, &frames[0]));
    EXPECT(reports > 0);
    check_values(frames[0]);
    EXPECT(has_pass(frames[0], "rsm") && has_pass(frames[0], "vpl"));

    /* The same camera, half a turn about x, and a little to the right. */
    pose.position_m[0] = 0.125;
    pose.position_m[2] = 3.5;
    pose.orientation_xyzw[0] = 1;
    pose.orientation_xyzw[3] = 0;
    OK(camlux_scene_set_pose(scene, CAMLUX_PART_CAMERA, 0, &pose));
    OK(camlux_renderer_render(renderer, scene, NULL, &frames[1]));
    EXPECT(!has_pass(frames[1], "rsm") && !has_pass(frames[1], "vpl"));
    pose.position_m[0] = 0;
    OK(camlux_scene_set_pose(scene, CAMLUX_PART_CAMERA, 0, &pose));
    OK(camlux_renderer_render(renderer, scene, NULL, &frames[2]));
    EXPECT(memcmp(values_of(frames[0], CAMLUX_LAYER_RADIANCE), values_of(frames[2], CAMLUX_LAYER_RADIANCE),
                  3 * SIZE_PX * SIZE_PX * sizeof(float)) == 0);

    check_errors(scene, renderer);
    OK(camlux_frame_retain(frames[0]));
    OK(camlux_frame_release(frames[0]));
    check_values(frames[0]);
    OK(camlux_set_log(CAMLUX_LOG_OFF, NULL, NULL));
    OK(camlux_renderer_release(renderer));
    OK(camlux_scene_release(scene));
    OK(camlux_frame_release(frames[0]));
    OK(camlux_frame_release(frames[1]));
    OK(camlux_frame_release(frames[2]));
    OK(camlux_frame_release(NULL));
    OK(camlux_handle_count(&left));
    EXPECT(left == 0);
}

/* Resident memory, kB; 0 if unknown. */
static long resident_kb(void)
{
    FILE *file;
    long pages = 0, resident = 0;
#ifdef __GLIBC__
    malloc_trim(0); /* Freed memory that malloc still holds is no leak. */
#endif
    file = fopen("/proc/self/statm", "r");
    if (file == NULL)
        return 0;
    if (fscanf(file, "%ld %ld", &pages, &resident) != 2)
        resident = 0;
    fclose(file);
    return resident * 4;
}

static void check_cycles(int count)
{
    long at_tenth_kb = 0, at_end_kb;
    int i;
    uint32_t left = 1;
    camlux_device *device = NULL;
    OK(camlux_device_create(NULL, &device));
    for (i = 1; i <= count; i++) {
        /* Each renderer compiles its pipelines. Nine in ten compile only the few of direct light. */
        camlux_scene *scene = make_box(i % 10 == 0);
        camlux_renderer *renderer = NULL;
        camlux_frame *frame = NULL;
        OK(camlux_renderer_create(device, &renderer));
        OK(camlux_renderer_render(renderer, scene, NULL, &frame));
        OK(camlux_frame_release(frame));
        OK(camlux_renderer_release(renderer));
        OK(camlux_scene_release(scene));
        if (i == count / 10)
            at_tenth_kb = resident_kb();
    }
    at_end_kb = resident_kb();
    printf("resident after %d cycles %ld kB, after %d cycles %ld kB\n", count / 10, at_tenth_kb, count, at_end_kb);
    if (count >= 1000)
        EXPECT(at_end_kb <= at_tenth_kb + at_tenth_kb / 100);
    OK(camlux_device_release(device));
    OK(camlux_handle_count(&left));
    EXPECT(left == 0);
}

int main(int argc, char **argv)
{
    if (argc == 3 && strcmp(argv[1], "cycles") == 0)
        check_cycles(atoi(argv[2]));
    else
        check_everything();
    if (failures > 0)
        fprintf(stderr, "%d checks failed\n", failures);
    return failures > 0;
}
