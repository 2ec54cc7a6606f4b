/* What Embree takes to load a mesh, and for rays against it, on one thread.
 *
 *     cc -O2 -o embree embree.c -ldl
 *     ./embree libembree4.so.4 mesh.stl rows.f32 shuffled.f32
 *
 * The mesh is a binary STL. A file of rays has little-endian 32-bit floats: where all rays start,
 * and the directions. Prints, separated by blanks,
 *
 *     load SECONDS PEAK_BYTES
 *     rays WAY PER_SECOND HITS        of each file in turn; ways: single, wide, coherent
 *
 * Times are those for which the process was on a processor, rates the best of several rounds.
 * Embree is loaded when this runs, so that neither it nor its headers are needed to build this.
 * Its types and numbers are those of its version 4. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { ROUNDS = 9, LANES = 16 };
enum { TRIANGLES = 0, INDICES = 0, VERTICES = 1, UINT3 = 0x5003, FLOAT3 = 0x9003 };
enum { MEDIUM_QUALITY = 1, ROBUST = 4, COHERENT = 1 << 16 };
static const uint32_t NONE = ~0u;
static const float FARTHEST = 1e4f;

typedef void *Handle;

typedef struct {
    float org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, time, tfar;
    uint32_t mask, id, flags;
    float normal_x, normal_y, normal_z, u, v;
    uint32_t triangle, geometry, instance, instance_part;
} __attribute__((aligned(16))) One;

typedef struct {
    float org_x[LANES], org_y[LANES], org_z[LANES], tnear[LANES];
    float dir_x[LANES], dir_y[LANES], dir_z[LANES], time[LANES], tfar[LANES];
    uint32_t mask[LANES], id[LANES], flags[LANES];
    float normal_x[LANES], normal_y[LANES], normal_z[LANES], u[LANES], v[LANES];
    uint32_t triangle[LANES], geometry[LANES], instance[LANES], instance_part[LANES];
} __attribute__((aligned(64))) Many;

typedef struct {
    uint32_t flags, features;
    void *context, *filter, *intersect;
} Arguments;

static Handle (*new_device)(const char *);
static Handle (*new_scene)(Handle);
static Handle (*new_geometry)(Handle, int);
static void *(*new_buffer)(Handle, int, unsigned, int, size_t, size_t);
static void (*commit_geometry)(Handle);
static unsigned (*attach)(Handle, Handle);
static void (*set_flags)(Handle, int);
static void (*set_quality)(Handle, int);
static void (*commit_scene)(Handle);
static void (*intersect)(Handle, One *, Arguments *);
static void (*intersect_many)(const int *, Handle, Many *, Arguments *);
static int (*device_error)(Handle);

static void fail(const char *what) {
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static void open_library(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_GLOBAL);
    if (!library) fail(dlerror());
    const struct { void *function; const char *name; } wanted[] = {
        {&new_device, "rtcNewDevice"}, {&new_scene, "rtcNewScene"},
        {&new_geometry, "rtcNewGeometry"}, {&new_buffer, "rtcSetNewGeometryBuffer"},
        {&commit_geometry, "rtcCommitGeometry"}, {&attach, "rtcAttachGeometry"},
        {&set_flags, "rtcSetSceneFlags"}, {&set_quality, "rtcSetSceneBuildQuality"},
        {&commit_scene, "rtcCommitScene"}, {&intersect, "rtcIntersect1"},
        {&intersect_many, "rtcIntersect16"}, {&device_error, "rtcGetDeviceError"},
    };
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        void *found = dlsym(library, wanted[i].name);
        if (!found) fail(dlerror());
        memcpy(wanted[i].function, &found, sizeof found);
    }
}

static double seconds(void) {
    struct timespec spent;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
    return spent.tv_sec + 1e-9 * spent.tv_nsec;
}

/* Most memory so far. Not that of getrusage, which a process inherits from the one that started it. */
static long peak_bytes(void) {
    FILE *status = fopen("/proc/self/status", "r");
    char line[256];
    long kibibytes = 0;
    while (status && fgets(line, sizeof line, status)) {
        if (sscanf(line, "VmHWM: %ld", &kibibytes) == 1) break;
    }
    if (status) fclose(status);
    return 1024 * kibibytes;
}

static void *read_file(const char *path, size_t *bytes) {
    FILE *file = fopen(path, "rb");
    if (!file) fail(path);
    fseek(file, 0, SEEK_END);
    *bytes = ftell(file);
    rewind(file);
    char *content = malloc(*bytes);
    if (!content || fread(content, 1, *bytes, file) != *bytes) fail(path);
    fclose(file);
    return content;
}

static Handle load(const char *path) {
    double began = seconds();
    size_t bytes;
    char *stl = read_file(path, &bytes);
    uint32_t count;
    memcpy(&count, stl + 80, sizeof count);
    Handle device = new_device("threads=1"), scene = new_scene(device);
    set_flags(scene, ROBUST);
    set_quality(scene, MEDIUM_QUALITY);
    Handle geometry = new_geometry(device, TRIANGLES);
    float *vertices = new_buffer(geometry, VERTICES, 0, FLOAT3, 12, 3ul * count);
    uint32_t *indices = new_buffer(geometry, INDICES, 0, UINT3, 12, count);
    for (uint32_t i = 0; i < count; i++) memcpy(vertices + 9ul * i, stl + 96 + 50ul * i, 36);
    for (uint32_t i = 0; i < 3 * count; i++) indices[i] = i;
    free(stl);
    commit_geometry(geometry);
    attach(scene, geometry);
    commit_scene(scene);
    if (device_error(device)) fail("Embree reports an error");
    double taken = seconds() - began;
    printf("load %f %ld\n", taken, peak_bytes());
    return scene;
}

static size_t one_by_one(Handle scene, const float *rays, size_t count, uint32_t flags) {
    Arguments arguments = {.flags = flags, .features = ~0u};
    size_t hits = 0;
    for (size_t i = 0; i < count; i++) {
        const float *to = rays + 3 + 3 * i;
        One ray = {.org_x = rays[0], .org_y = rays[1], .org_z = rays[2], .dir_x = to[0],
            .dir_y = to[1], .dir_z = to[2], .tfar = FARTHEST, .mask = ~0u, .geometry = NONE,
            .instance = NONE};
        intersect(scene, &ray, &arguments);
        hits += ray.geometry != NONE;
    }
    return hits;
}

static size_t at_once(Handle scene, const float *rays, size_t count, uint32_t flags) {
    Arguments arguments = {.flags = flags, .features = ~0u};
    int valid[LANES] __attribute__((aligned(64)));
    size_t hits = 0;
    for (size_t first = 0; first < count; first += LANES) {
        Many many;
        for (size_t k = 0; k < LANES; k++) {
            size_t i = first + k < count ? first + k : count - 1;
            const float *to = rays + 3 + 3 * i;
            valid[k] = first + k < count ? -1 : 0;
            many.org_x[k] = rays[0], many.org_y[k] = rays[1], many.org_z[k] = rays[2];
            many.dir_x[k] = to[0], many.dir_y[k] = to[1], many.dir_z[k] = to[2];
            many.tnear[k] = many.time[k] = 0, many.tfar[k] = FARTHEST;
            many.mask[k] = ~0u, many.id[k] = many.flags[k] = 0;
            many.geometry[k] = many.instance[k] = NONE;
        }
        intersect_many(valid, scene, &many, &arguments);
        for (size_t k = 0; k < LANES; k++) hits += valid[k] && many.geometry[k] != NONE;
    }
    return hits;
}

int main(int count, char **words) {
    if (count < 3) fail("usage: embree LIBRARY MESH.stl [RAYS.f32]...");
    open_library(words[1]);
    Handle scene = load(words[2]);
    const struct {
        const char *name;
        size_t (*cast)(Handle, const float *, size_t, uint32_t);
        uint32_t flags;
    } ways[] = {{"single", one_by_one, 0}, {"wide", at_once, 0}, {"coherent", at_once, COHERENT}};
    for (int file = 3; file < count; file++) {
        size_t bytes;
        float *rays = read_file(words[file], &bytes);
        size_t directions = bytes / 12 - 1;
        for (size_t way = 0; way < sizeof ways / sizeof *ways; way++) {
            double least = 1e9;
            size_t hits = 0;
            for (int round = 0; round < ROUNDS; round++) {
                double began = seconds();
                hits = ways[way].cast(scene, rays, directions, ways[way].flags);
                double taken = seconds() - began;
                if (taken < least) least = taken;
            }
            printf("rays %s %f %zu\n", ways[way].name, directions / least, hits);
        }
        free(rays);
    }
    return 0;
}
