/* The C++20 wrapper against the functions that it wraps, bit for bit: wrapper FINGERTIP.fpm FINGERTIP-PAD.fpm
 * Both sides take the same disturbed paths: reversals, spin, strength factors, NaN, too large depths, poses and time steps. */
#include <fingerpad.hpp>

#include "common.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <type_traits>

namespace {

namespace fp = fingerpad;

int failures = 0;
unsigned compared = 0;

void expect(bool holds, const char *what, unsigned step = 0)
{
    if (!holds) {
        (void)std::printf("not so at step %u: %s\n", step, what);
        failures++;
    }
}

void expect(fp::Code got, fp::Code want, const char *what)
{
    if (got != want) {
        (void)std::printf("%s: %s, wanted %s\n", what, fp::text(got), fp::text(want));
        failures++;
    }
}

template <class T>
bool same(const T &a, const T &b)
{
    static_assert(std::is_trivially_copyable_v<T>);
    compared++;
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

std::span<const std::byte> bytes_in(const model_file &file)
{
    return std::as_bytes(std::span(file.words)).first(file.length);
}

/* A value for a test that cannot go on without it. */
template <class T>
T must_get(const fp::Result<T> &result, const char *what)
{
    if (!result) {
        (void)std::fprintf(stderr, "%s: %s\n", what, result.text());
        std::exit(2);
    }
    return *result.get();
}

/* Numbers from -1 to 1 (xorshift), the same in every run. */
float noise()
{
    static std::uint32_t x = 20111;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return static_cast<float>(x) / 2147483648.0f - 1.0f;
}

/* A step of a path; every 97th has something wrong with it. */
fp::Motion disturbed(unsigned i)
{
    fp::Motion m{0.8f + 0.8f * noise(), 0.05f * noise(), 0.02f * noise(), 0.01f * noise(), 1e-3f};
    if (i % 97 == 0) {
        const float wrong[] = {NAN, INFINITY, -INFINITY, 1e9f, -1.0f};
        float *const numbers[] = {&m.depth_mm, &m.slide_x_mm, &m.slide_y_mm, &m.spin_rad, &m.dt_s};
        *numbers[i / 97 % 5] = wrong[i / 485 % 5];
    }
    return m;
}

template <class Kind>
void contacts(const fp::Bed &bed, const fingerpad_model &model)
{
    fp::ContactOf<Kind> finger;
    typename Kind::State state;
    (void)Kind::init(&state);
    expect(same(finger.c(), state), "a new contact");
    for (unsigned i = 0; i < 4000; i++) {
        const fp::Motion motion = disturbed(i);
        fp::Response want{};
        if (i % 50 == 0) {
            const float factor = 1.0f + 2.0f * noise();
            expect(finger.set_strength_factor(factor), static_cast<fp::Code>(Kind::set_strength_factor(&state, factor)),
                   "a strength factor");
        }
        if (i % 40 == 39) {
            const fp::Drive drive{1, static_cast<std::uint16_t>(i % 80 == 79), motion.depth_mm, 0.3f, motion.slide_x_mm,
                                  motion.slide_y_mm, 0.05f, -0.02f, motion.spin_rad, 1e-3f};
            fp::Motion to{};
            const auto driven = finger.step_driven(bed, drive);
            must(Kind::step_driven(&model, &state, drive, &want, &to), "a driven step");
            const fp::Driven got = must_get(driven, "a driven step");
            expect(same(got.response, want) && same(got.motion, to), "a driven step", i);
        } else {
            const auto stepped = finger.step(bed, motion);
            must(Kind::step(&model, &state, motion, &want), "a step");
            const fp::Response got = must_get(stepped, "a step");
            expect(same(got, want), "a step", i);
            expect(fp::has(got, fp::Flag::bad_input) == ((want.status & FINGERPAD_STATUS_BAD_INPUT) != 0), "a flag", i);
            expect(static_cast<std::uint32_t>(fp::regime(got)) == want.regime, "a regime", i);
        }
        expect(same(finger.c(), state), "the state", i);
        if (i % 100 == 0) {
            fp::Gradient slopes{};
            must(Kind::gradient(&model, &state, 0.1f, 1.0f, 0.5f, &slopes), "a gradient");
            expect(same(must_get(finger.gradient(bed, 0.1f, 1.0f, 0.5f), "a gradient"), slopes), "a gradient", i);
        }
    }
    std::array<std::byte, Kind::saved_bytes> saved{};
    std::array<std::uint8_t, Kind::saved_bytes> want{};
    expect(finger.save(bed, saved), fp::Code::ok, "a state saved");
    must(Kind::save(&model, &state, want.data(), want.size()), "a state saved");
    expect(std::memcmp(saved.data(), want.data(), want.size()) == 0, "the bytes of a saved state");
    expect(same(must_get(fp::ContactOf<Kind>::restore(bed, saved), "a state restored").c(), state), "a restored state");
    expect(finger.save(bed, std::span(saved).first(saved.size() - 1)), fp::Code::buffer, "too small a buffer");
    expect(fp::ContactOf<Kind>::restore(bed, std::span(saved).first(saved.size() - 1)).code(), fp::Code::length, "a cut state");
    saved[60] ^= std::byte{1};
    expect(fp::ContactOf<Kind>::restore(bed, saved).code(), fp::Code::checksum, "a damaged state");
}

void batch(const fp::Bed &bed)
{
    constexpr std::size_t count = 9;
    std::array<fp::Contact, count> many, single;
    std::array<fp::Response, count> responses{};
    std::array<float, count> depth{}, x{}, y{};
    for (unsigned i = 0; i < 100; i++) {
        for (std::size_t k = 0; k < count; k++) {
            depth[k] = 0.5f + 0.4f * noise();
            x[k] = 0.02f * noise();
            y[k] = 0.02f * noise();
        }
        const fp::Motions motions{count, depth.data(), x.data(), y.data(), nullptr, 1e-3f};
        expect(fp::Contact::step_batch(bed, many, motions, responses), fp::Code::ok, "a batch");
        for (std::size_t k = 0; k < count; k++) {
            const auto one = single[k].step(bed, {depth[k], x[k], y[k], 0.0f, 1e-3f});
            expect(same(must_get(one, "a step"), responses[k]) && same(single[k].c(), many[k].c()), "a batch", i);
        }
        expect(fp::Contact::step_batch(bed, many, motions, std::span(responses).first(count - 1)), fp::Code::buffer,
               "fewer responses than contacts");
        expect(fp::Contact::step_batch(bed, std::span(many).first(count - 1), motions, std::span(responses).first(count - 1)),
               fp::Code::buffer, "fewer contacts than motions");
        expect(same(single[0].c(), many[0].c()), "a refused batch changes a contact");
    }
}

/* Of a pad that does not relax, or of any. */
template <class Contact>
void pads(const fp::Pad &pad, const fingerpad_pad &wrapped)
{
    const fp::Body bodies[] = {fp::plane(), fp::sphere(20.0f), fp::cylinder(-60.0f, 30.0f), fp::edge(3.0f, 80.0f, 90.0f)};
    const fingerpad_body same_bodies[] = {{FINGERPAD_BODY_PLANE, 0.0f, 0.0f, 0.0f},
                                          {FINGERPAD_BODY_SPHERE, 20.0f, 0.0f, 0.0f},
                                          {FINGERPAD_BODY_CYLINDER, -60.0f, 30.0f, 0.0f},
                                          {FINGERPAD_BODY_EDGE, 3.0f, 80.0f, 90.0f}};
    const fp::PadInfo info = must_get(pad.info(), "a pad described");
    for (unsigned b = 0; b < 4; b++) {
        Contact finger = b == 0 ? must_get(Contact::on_plane(pad), "a contact")
                                       : must_get(Contact::over(pad, 35.0f, -5.0f), "a contact over a body");
        // What lies beyond the patches of this pad is left as it was.
        fingerpad_relaxing_pad_state room{};
        fingerpad_pad_state &state = room.state;
        must(b == 0 ? fingerpad_relaxing_pad_state_init(&wrapped, &room) : fingerpad_relaxing_pad_state_init_over(&wrapped, &room, 35.0f, -5.0f),
             "a state");
        expect(same(finger.c(), state), "a new contact of a pad");
        for (unsigned i = 0; i < 500; i++) {
            const fp::Motion m = disturbed(i);
            const float swing = std::sin(0.02f * static_cast<float>(i));
            fp::PadMotion motion{m.depth_mm, m.slide_x_mm, m.slide_y_mm, m.spin_rad, 35.0f + 20.0f * swing, -5.0f + 10.0f * swing,
                                 m.dt_s};
            fp::Response want{};
            if (i % 193 == 0) {
                motion.pitch_deg = NAN;
            }
            if (i % 100 == 0) {
                const float factor = 1.0f + 2.0f * noise();
                expect(finger.set_strength_factor(factor),
                       static_cast<fp::Code>(fingerpad_pad_state_set_strength_factor(&state, factor)), "a strength factor");
            }
            const auto stepped = finger.step(pad, bodies[b], motion);
            must(fingerpad_pad_step(&wrapped, &state, same_bodies[b], motion, &want), "a step of a pad");
            expect(same(must_get(stepped, "a step of a pad"), want) && same(finger.c(), state), "a step of a pad", i);
        }
        std::array<fp::Patch, FINGERPAD_PATCHES_MAX> got{}, want{};
        const auto patches = must_get(finger.patches(pad, bodies[b], got), "patches");
        must(fingerpad_pad_patches(&wrapped, &state, same_bodies[b], want.data(), want.size()), "patches");
        expect(patches.size() == info.patches && same(got, want), "patches");
        expect(finger.patches(pad, bodies[b], std::span(got).first(info.patches - 1)).code(), fp::Code::buffer, "few patches");
        std::array<std::byte, Contact::saved_bytes_max> saved{};
        expect(finger.save(pad, saved), fp::Code::ok, "a pad's state saved");
        const auto restored = Contact::restore(pad, std::span(saved).first(info.state_bytes));
        // Compared as bytes: what lies beyond the patches of this pad is not kept.
        std::array<std::byte, Contact::saved_bytes_max> again{};
        expect(must_get(restored, "a pad's state restored").save(pad, again), fp::Code::ok, "a restored state saved");
        expect(saved == again, "a pad's restored state");
        saved[100] ^= std::byte{4};
        expect(Contact::restore(pad, std::span(saved).first(info.state_bytes)).code(), fp::Code::checksum,
               "a damaged state of a pad");
        const fingerpad_pad_state before = finger.c();
        for (const fp::Body &wrong : {fp::sphere(0.0f), fp::sphere(NAN), fp::cylinder(20.0f, 181.0f), fp::edge(3.0f, 0.0f, 180.0f),
                                      fp::Body{7, 1.0f, 0.0f, 0.0f}}) {
            const auto refused = finger.step(pad, wrong, {1.0f, 0.0f, 0.0f, 0.0f, 35.0f, 0.0f, 1e-3f});
            expect(refused.code(), fp::Code::range, "a body that cannot be");
            expect(!refused && refused.get() == nullptr, "a refused step has no response");
        }
        expect(same(finger.c(), before), "a refused body changes the state");
    }
    for (const float pitch_deg : {12.0f, 30.0f, 68.0f}) {
        std::array<float, 3> want{};
        must(fingerpad_pad_first_touch(&wrapped, pitch_deg, 7.0f, want.data()), "first touch");
        expect(same(must_get(pad.first_touch(pitch_deg, 7.0f), "first touch"), want), "first touch");
    }
    expect(pad.first_touch(NAN, 0.0f).code(), fp::Code::range, "a pitch of NaN");
    expect(Contact::over(pad, 30.0f, NAN).code(), fp::Code::range, "a roll of NaN");
}

/* A body that presses, slides and turns below a finger of about pitch 30, its origin `height_mm` below its apex; every 61st pose is none. */
fp::Pose pose_below(unsigned i, double height_mm)
{
    const double t = 0.02 * static_cast<double>(i);
    const double pitch = -0.52 - 0.1 * std::sin(t), yaw = 0.3 * std::sin(0.7 * t);
    const double c = std::cos(0.5 * pitch), s = std::sin(0.5 * pitch), cz = std::cos(0.5 * yaw), sz = std::sin(0.5 * yaw);
    const double along_normal = 0.6 + std::sin(0.5 * t) + 0.01 * static_cast<double>(noise()) - height_mm;
    fp::Pose pose{{std::sin(pitch) * along_normal + 0.4 * std::sin(t), 0.3 * std::sin(1.3 * t), std::cos(pitch) * along_normal},
                  {c * cz, s * sz, s * cz, c * sz}};
    if (i % 61 == 60) {
        pose.quaternion[i / 61 % 4] = i % 122 == 121 ? 2.0 : static_cast<double>(NAN);
    }
    return pose;
}

struct PadFrames {
    using Model = fp::Pad;
    using Wrapped = fingerpad_pad;
    static constexpr auto init = fingerpad_relaxing_frame_init_pad;
    static constexpr auto step = fingerpad_frame_step_pad;
    static constexpr bool has_patches = true;
};

struct BedFrames {
    using Model = fp::Bed;
    using Wrapped = fingerpad_model;
    static std::int32_t init(const fingerpad_model *model, fingerpad_shape shape, fingerpad_relaxing_frame_contact *room)
    {
        return fingerpad_frame_init_bed(model, shape, &room->contact);
    }
    static constexpr auto step = fingerpad_frame_step_bed;
    static constexpr bool has_patches = false;
};

template <class Contact, class Frames>
void framed(const typename Frames::Model &model, const typename Frames::Wrapped &wrapped, const fp::Shape &shape,
            const fingerpad_shape &same_shape, double height_mm)
{
    auto finger = must_get(Contact::with(model, shape), "a contact in frames");
    fingerpad_relaxing_frame_contact room;
    fingerpad_frame_contact &contact = room.contact;
    must(Frames::init(&wrapped, same_shape, &room), "a contact in frames");
    unsigned touches = 0, flagged = 0;
    for (unsigned i = 0; i < 400; i++) {
        if (i % 100 == 50) {
            const float factor = 1.0f + 2.0f * noise();
            expect(finger.set_strength_factor(factor), static_cast<fp::Code>(fingerpad_frame_set_strength_factor(&contact, factor)),
                   "a strength factor");
        }
        const fp::Pose pose = pose_below(i, height_mm);
        fp::FrameResponse want{};
        must(Frames::step(&wrapped, &contact, &pose, 1e-3f, &want), "a step in frames");
        const fp::FrameResponse got = must_get(finger.step(model, pose, 1e-3f), "a step in frames");
        expect(same(got, want), "a step in frames", i);
        if constexpr (Frames::has_patches) {
            std::array<fp::FramePatch, FINGERPAD_PATCHES_MAX> room_for{}, want_patches{};
            const auto patches = must_get(finger.patches(model, room_for), "patches in frames");
            must(fingerpad_frame_patches(&wrapped, &contact, want_patches.data(), want_patches.size()), "patches in frames");
            expect(patches.size() > 20 && same(room_for, want_patches), "patches in frames", i);
        }
        touches += got.on_finger.force_n[2] > 0.05f;
        flagged += fp::has(got.response, fp::Flag::bad_input);
    }
    expect(touches > 100 && flagged == 6, "the body is touched, and poses that are none are flagged");
}

template <class Contact>
void frames(const fp::Bed &bed, const fp::Pad &pad, const fingerpad_model &model, const fingerpad_pad &wrapped)
{
    const struct {
        fp::Shape shape;
        fingerpad_shape same;
        double height_mm;
    } bodies[] = {
        {fp::shapes::plane(), {FINGERPAD_SHAPE_PLANE, {0.0, 0.0, 0.0}, 0.0, 0.0}, 0.0},
        {fp::shapes::box(30.0, 20.0, 10.0, 3.0), {FINGERPAD_SHAPE_BOX, {30.0, 20.0, 10.0}, 3.0, 0.0}, 10.0},
        {fp::shapes::sphere(20.0), {FINGERPAD_SHAPE_SPHERE, {20.0, 0.0, 0.0}, 0.0, 0.0}, 20.0},
        {fp::shapes::ellipsoid(30.0, 25.0, 20.0), {FINGERPAD_SHAPE_ELLIPSOID, {30.0, 25.0, 20.0}, 0.0, 0.0}, 20.0},
        {fp::shapes::capsule(15.0, 10.0), {FINGERPAD_SHAPE_CAPSULE, {15.0, 10.0, 0.0}, 0.0, 0.0}, 25.0},
        {fp::shapes::cylinder(25.0, 10.0), {FINGERPAD_SHAPE_CYLINDER, {25.0, 10.0, 0.0}, 0.0, 0.0}, 10.0},
        {fp::shapes::edge(4.0, 100.0), {FINGERPAD_SHAPE_EDGE, {4.0, 0.0, 0.0}, 0.0, 100.0}, 0.0},
    };
    for (const auto &body : bodies) {
        framed<Contact, PadFrames>(pad, wrapped, body.shape, body.same, body.height_mm);
        if (&body < bodies + 2) {
            framed<Contact, BedFrames>(bed, model, body.shape, body.same, body.height_mm);
        } else {
            expect(Contact::with(bed, body.shape).code(), fp::Code::range, "a curved body of a bed");
        }
    }
    expect(Contact::with(pad, fp::shapes::sphere(0.0)).code(), fp::Code::range, "a sphere of radius 0");
    Contact of_bed = must_get(Contact::with(bed, fp::shapes::plane()), "a contact in frames");
    const fingerpad_frame_contact before = of_bed.c();
    expect(of_bed.step(pad, pose_below(0, 0.0), 1e-3f).code(), fp::Code::not_set_up, "a contact of a bed with a pad");
    expect(same(of_bed.c(), before), "a refused step changes the contact");
    Contact no_contact;
    expect(no_contact.step(pad, pose_below(0, 0.0), 1e-3f).code(), fp::Code::not_set_up, "a contact that was not made");
    expect(no_contact.set_strength_factor(1.0f), fp::Code::not_set_up, "a contact that was not made");
}

void misuse(const model_file &bed_file, const model_file &pad_file)
{
    const auto bed_bytes = bytes_in(bed_file), pad_bytes = bytes_in(pad_file);
    expect(fp::Bed::load(pad_bytes).code(), fp::Code::section, "a pad's file as a bed");
    expect(fp::Pad::load(bed_bytes).code(), fp::Code::section, "a bed's file as a pad");
    expect(fp::Pad::load_relaxing(bed_bytes).code(), fp::Code::section, "a bed's file as a pad of any tissue");
    expect(fp::Bed::load({}).code(), fp::Code::null, "no file");
    expect(fp::Bed::load(bed_bytes.first(bed_bytes.size() - 4)).code(), fp::Code::length, "a cut file");
    expect(fp::Bed::load(bed_bytes.subspan(1)).code(), fp::Code::alignment, "a file at an odd address");
    const fp::Bed no_bed;
    const fp::Pad no_pad;
    fp::Contact finger;
    fp::PadContact no_contact;
    const fp::Motion motion{0.8f, 0.01f, 0.0f, 0.0f, 1e-3f};
    expect(finger.step(no_bed, motion).code(), fp::Code::not_set_up, "a bed that was not loaded");
    fp::Response otherwise{};
    otherwise.normal_force_n = -1.0f;
    expect(same(finger.step(no_bed, motion).value_or(otherwise), otherwise), "the value of a refused call");
    expect(no_bed.info().code(), fp::Code::not_set_up, "a bed that was not loaded");
    expect(fp::PadContact::on_plane(no_pad).code(), fp::Code::not_set_up, "a pad that was not loaded");
    const fp::Pad pad = must_get(fp::Pad::load(pad_bytes), "pad");
    expect(no_contact.step(pad, fp::plane(), {}).code(), fp::Code::not_set_up, "a contact of a pad that was not made");
    expect(fp::Result<int>(fp::Code::ok).code(), fp::Code::unknown, "a refusal without a code");
    fp::Bed bed = must_get(fp::Bed::load(bed_bytes), "bed");
    const fp::Bed before = bed;
    expect(bed.tune(0.4f, 1.0f, 1.0f), fp::Code::range, "a size of 0.4");
    expect(bed.tune(1.0f, NAN, 1.0f), fp::Code::range, "a stiffness of NaN");
    expect(same(before.c(), bed.c()), "a refused tuning changes the bed");
}

void requests(const fp::Bed &bed, const fingerpad_model &model)
{
    fp::Grip want{};
    must(fingerpad_least_grip(&model, 0.2f, -0.1f, 0.3f, 0.9f, &want), "grip");
    const fp::Grip grip = must_get(bed.least_grip(0.2f, -0.1f, 0.3f, 0.9f), "grip");
    expect(same(grip.depth_mm, want.depth_mm) && same(grip.normal_force_n, want.normal_force_n) && same(grip.status, want.status),
           "a grip");
    const fp::BedInfo info = must_get(bed.info(), "info");
    expect(fp::meta(info).starts_with("{") && fp::meta(info).ends_with("}"), "the description of a model");

    fp::WatchSettings settings = fp::Watch::settings();
    fp::Watch watch = must_get(fp::Watch::make(3, settings), "watch");
    fingerpad_watch wrapped;
    must(fingerpad_watch_init(&wrapped, 3, settings), "watch");
    fp::Contact finger;
    unsigned seen = 0;
    for (unsigned i = 0; i < 600; i++) {
        const float depth_mm = 0.01f * static_cast<float>(i < 100 ? i : i < 500 ? 100 : 599 - i);
        const fp::Response r = must_get(finger.step(bed, {depth_mm, i < 500 ? 0.01f : 0.0f, 0.0f, 0.0f, 1e-3f}), "step");
        std::array<fp::Event, FINGERPAD_EVENTS_A_LOOK> got{}, events{};
        std::uint32_t count = 0;
        must(fingerpad_watch_look(&wrapped, &r, events.data(), &count), "look");
        const auto looked = must_get(watch.look(r, got), "look");
        expect(looked.size() == count, "the number of events", i);
        for (std::uint32_t k = 0; k < count; k++) {
            expect(same(got[k].tick, events[k].tick) && same(got[k].finger, events[k].finger)
                       && same(got[k].change, events[k].change),
                   "an event", i);
        }
        seen += count;
    }
    expect(seen >= 4, "touch, first slip, full slip and lift-off are seen");
    settings.full_slip = 1.5f;
    expect(fp::Watch::make(0, settings).code(), fp::Code::range, "a threshold of 1.5");
}

} // namespace

int main(int argc, char **argv)
{
    static model_file bed_file, pad_file;
    if (argc != 3) {
        return 2;
    }
    read_file(&bed_file, argv[1]);
    read_file(&pad_file, argv[2]);
    fp::Bed bed = must_get(fp::Bed::load(bytes_in(bed_file)), argv[1]);
    fp::Pad pad = must_get(fp::Pad::load(bytes_in(pad_file)), argv[2]);
    fingerpad_model model;
    fingerpad_pad wrapped;
    must(fingerpad_model_load(&model, bytes_of(&bed_file), bed_file.length), argv[1]);
    must(fingerpad_pad_load(&wrapped, bytes_of(&pad_file), pad_file.length), argv[2]);
    for (int tuned = 0; tuned < 2; tuned++) {
        if (tuned == 1) {
            expect(bed.tune(1.2f, 0.7f, 1.5f), fp::Code::ok, "a bed tuned");
            expect(pad.tune(1.2f, 0.7f, 1.5f), fp::Code::ok, "a pad tuned");
            must(fingerpad_model_tune(&model, 1.2f, 0.7f, 1.5f), "a model tuned");
            must(fingerpad_pad_tune(&wrapped, 1.2f, 0.7f, 1.5f), "a pad tuned");
        }
        expect(same(bed.c(), model) && same(pad.c(), wrapped), "bed and pad");
        contacts<fp::detail::Slides>(bed, model);
        contacts<fp::detail::Spins>(bed, model);
        batch(bed);
        pads<fp::PadContact>(pad, wrapped);
        frames<fp::FrameContact>(bed, pad, model, wrapped);
        {
            const fp::Branch branches[] = {{1.0f, 0.004f}, {0.6f, 0.07f}, {0.6f, 1.4f}};
            fp::Bed soft_bed = bed;
            fingerpad_model soft_model = model;
            expect(soft_bed.relax(branches), fp::Code::ok, "a bed that relaxes");
            must(fingerpad_model_relax(&soft_model, branches, 3), "a bed that relaxes");
            expect(must_get(soft_bed.info(), "info").branches == 3, "a bed that relaxes");
            contacts<fp::detail::RelaxingSlides>(soft_bed, soft_model);
            contacts<fp::detail::RelaxingSpins>(soft_bed, soft_model);
            contacts<fp::detail::RelaxingSlides>(bed, model);
            fp::Contact prompt;
            expect(prompt.step(soft_bed, disturbed(1)).code(), fp::Code::not_set_up, "a contact without the memory of its bed");
            const fp::Bed of_any = must_get(fp::Bed::load_relaxing(bytes_in(bed_file)), argv[1]);
            expect(must_get(of_any.info(), "info").checksum == must_get(bed.info(), "info").checksum, "a bed of any tissue");
            fp::Pad soft = pad;
            fingerpad_pad wrapped_soft = wrapped;
            expect(soft.relax(branches), fp::Code::ok, "a pad that relaxes");
            must(fingerpad_pad_relax(&wrapped_soft, branches, 3), "a pad that relaxes");
            expect(fp::PadContact::on_plane(soft).code(), fp::Code::buffer, "a contact without room for its memory");
            pads<fp::RelaxingPadContact>(soft, wrapped_soft);
            frames<fp::RelaxingFrameContact>(soft_bed, soft, soft_model, wrapped_soft);
            frames<fp::FrameContact>(soft_bed, pad, soft_model, wrapped);
            expect(fp::FrameContact::with(soft, fp::shapes::plane()).code(), fp::Code::buffer, "a contact in frames without room");
            fingerpad_pad wrapped_any;
            must(fingerpad_relaxing_pad_load(&wrapped_any, bytes_of(&pad_file), pad_file.length), argv[2]);
            expect(same(must_get(fp::Pad::load_relaxing(bytes_in(pad_file)), argv[2]).c(), wrapped_any), "a pad of any tissue");
        }
        requests(bed, model);
    }
    misuse(bed_file, pad_file);
    (void)std::printf("C++20: %u comparisons with fingerpad.h bit for bit, %d failures\n", compared, failures);
    return failures != 0;
}
