/* fingerpad for C++20: beds, pads and their contacts as types, on the functions of fingerpad.h.
 *
 * Header only. It needs no exceptions, no run-time type information and no heap, and adds no memory to that of the C types.
 * A call that can be refused returns a `Code` or a `Result`. The value of a `Result` can be read only where there is one:
 *
 *     const auto stepped = finger.step(bed, {.depth_mm = 1.0f, .slide_x_mm = 0.1f, .slide_y_mm = 0.0f, .spin_rad = 0.0f, .dt_s = 1e-3f});
 *     if (const fingerpad::Response *r = stepped.get()) { use(r->friction_x_n); } else { report(stepped.text()); }
 *
 * Units, axes and ranges are those of fingerpad.h. All types are plain memory: copy a contact to return to it later. A bed and a
 * pad read their model file in place, so the file must outlive them. A default-constructed `Bed`, `Pad`, `PadContact` or `FrameContact`
 * is not set up, and calls with it are refused with `Code::not_set_up`. Contacts with effects are left to fingerpad.h; `c()` returns
 * the C object.
 */
#ifndef FINGERPAD_HPP
#define FINGERPAD_HPP

#include <fingerpad.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace fingerpad {

/* The codes of fingerpad.h. */
enum class [[nodiscard]] Code : std::int32_t {
    ok = FINGERPAD_OK,
    not_a_model = FINGERPAD_NOT_A_MODEL,
    version_unknown = FINGERPAD_VERSION_UNKNOWN,
    length = FINGERPAD_LENGTH,
    checksum = FINGERPAD_CHECKSUM,
    alignment = FINGERPAD_ALIGNMENT,
    shape = FINGERPAD_SHAPE,
    section = FINGERPAD_SECTION,
    range = FINGERPAD_RANGE,
    not_monotone = FINGERPAD_NOT_MONOTONE,
    not_passive = FINGERPAD_NOT_PASSIVE,
    buffer = FINGERPAD_BUFFER,
    other_model = FINGERPAD_OTHER_MODEL,
    unknown = FINGERPAD_UNKNOWN,
    null = FINGERPAD_NULL,
    not_set_up = FINGERPAD_NOT_SET_UP,
};

/* The meaning of a code in English; never null. */
inline const char *text(Code code) noexcept
{
    return fingerpad_error_text(static_cast<std::int32_t>(code));
}

/* The value of a call, or the code with which the call was refused. */
template <class T>
class [[nodiscard]] Result {
public:
    constexpr Result(const T &value) noexcept : value_(value) {}
    /* A refusal; `Code::ok` without a value counts as `Code::unknown`. */
    constexpr Result(Code code) noexcept : code_(code == Code::ok ? Code::unknown : code) {}

    constexpr explicit operator bool() const noexcept { return code_ == Code::ok; }
    constexpr Code code() const noexcept { return code_; }
    const char *text() const noexcept { return fingerpad::text(code_); }
    /* The value, or null for a refused call. It lives as long as the result. */
    constexpr T *get() & noexcept { return *this ? &value_ : nullptr; }
    constexpr const T *get() const & noexcept { return *this ? &value_ : nullptr; }
    T *get() && = delete;
    const T *get() const && = delete;
    constexpr T value_or(const T &otherwise) const noexcept { return *this ? value_ : otherwise; }

private:
    T value_{};
    Code code_ = Code::ok;
};

using Motion = fingerpad_motion;
using Motions = fingerpad_motions;
using Drive = fingerpad_drive;
using Response = fingerpad_response;
using Gradient = fingerpad_gradient;
using Grip = fingerpad_grip;
using BedInfo = fingerpad_model_info;
using PadMotion = fingerpad_pad_motion;
using PadInfo = fingerpad_pad_info;
using Body = fingerpad_body;
using Patch = fingerpad_patch;
using Branch = fingerpad_branch;
using Shape = fingerpad_shape;
using Pose = fingerpad_pose;
using Wrench = fingerpad_wrench;
using FrameResponse = fingerpad_frame_response;
using FramePatch = fingerpad_frame_patch;
using Event = fingerpad_event;
using WatchSettings = fingerpad_watch_settings;

enum class Regime : std::uint32_t {
    no_contact = FINGERPAD_NO_CONTACT,
    stick = FINGERPAD_STICK,
    partial_slip = FINGERPAD_PARTIAL_SLIP,
    slip = FINGERPAD_SLIP,
};

/* Flags of `Response::status`. */
enum class Flag : std::uint32_t {
    bad_input = FINGERPAD_STATUS_BAD_INPUT,
    bad_time_step = FINGERPAD_STATUS_BAD_TIME_STEP,
    depth_above_range = FINGERPAD_STATUS_DEPTH_ABOVE_RANGE,
    large_increment = FINGERPAD_STATUS_LARGE_INCREMENT,
    load_not_reached = FINGERPAD_STATUS_LOAD_NOT_REACHED,
    spin_ignored = FINGERPAD_STATUS_SPIN_IGNORED,
    memory_lost = FINGERPAD_STATUS_MEMORY_LOST,
    effect_held = FINGERPAD_STATUS_EFFECT_HELD,
    pose_out_of_range = FINGERPAD_STATUS_POSE_OUT_OF_RANGE,
    not_converged = FINGERPAD_STATUS_NOT_CONVERGED,
    body_too_sharp = FINGERPAD_STATUS_BODY_TOO_SHARP,
    began_inside = FINGERPAD_STATUS_BEGAN_INSIDE,
    beyond_edge = FINGERPAD_STATUS_BEYOND_EDGE,
};

constexpr Regime regime(const Response &response) noexcept { return static_cast<Regime>(response.regime); }

constexpr bool has(const Response &response, Flag flag) noexcept
{
    return (response.status & static_cast<std::uint32_t>(flag)) != 0;
}

/* The first `length` bytes of a model file that is a constant of words (fingertip_fpm.h); at most all of them. */
inline std::span<const std::byte> bytes(std::span<const std::uint32_t> words, std::size_t length) noexcept
{
    const std::span<const std::byte> all = std::as_bytes(words);
    return length < all.size() ? all.first(length) : all;
}

constexpr Body plane() noexcept { return {FINGERPAD_BODY_PLANE, 0.0f, 0.0f, 0.0f}; }
/* Negative radius: a bowl. */
constexpr Body sphere(float radius_mm) noexcept { return {FINGERPAD_BODY_SPHERE, radius_mm, 0.0f, 0.0f}; }
/* Negative radius: a trough. */
constexpr Body cylinder(float radius_mm, float axis_deg) noexcept
{
    return {FINGERPAD_BODY_CYLINDER, radius_mm, axis_deg, 0.0f};
}
constexpr Body edge(float radius_mm, float axis_deg, float angle_deg) noexcept
{
    return {FINGERPAD_BODY_EDGE, radius_mm, axis_deg, angle_deg};
}

/* Shapes of rigid bodies in frames of their own, for a `FrameContact`; sizes are 0.1 to 1e6 mm. */
namespace shapes {

/* The plane z = 0, the body below it. */
constexpr Shape plane() noexcept { return {FINGERPAD_SHAPE_PLANE, {}, 0.0, 0.0}; }
constexpr Shape sphere(double radius_mm) noexcept { return {FINGERPAD_SHAPE_SPHERE, {radius_mm, 0.0, 0.0}, 0.0, 0.0}; }
constexpr Shape ellipsoid(double x_mm, double y_mm, double z_mm) noexcept
{
    return {FINGERPAD_SHAPE_ELLIPSOID, {x_mm, y_mm, z_mm}, 0.0, 0.0};
}
/* About z; half the length without the round ends. */
constexpr Shape capsule(double radius_mm, double half_length_mm) noexcept
{
    return {FINGERPAD_SHAPE_CAPSULE, {radius_mm, half_length_mm, 0.0}, 0.0, 0.0};
}
/* About z, with flat ends. */
constexpr Shape cylinder(double radius_mm, double half_length_mm) noexcept
{
    return {FINGERPAD_SHAPE_CYLINDER, {radius_mm, half_length_mm, 0.0}, 0.0, 0.0};
}
/* Along x, on which the origin lies, z out of the body; the angle is inside the body, 1 to 179 degrees. */
constexpr Shape edge(double radius_mm, double angle_deg) noexcept
{
    return {FINGERPAD_SHAPE_EDGE, {radius_mm, 0.0, 0.0}, 0.0, angle_deg};
}
/* Half the extents along x, y and z. */
constexpr Shape box(double x_mm, double y_mm, double z_mm, double edge_radius_mm) noexcept
{
    return {FINGERPAD_SHAPE_BOX, {x_mm, y_mm, z_mm}, edge_radius_mm, 0.0};
}

} // namespace shapes

namespace detail {

inline std::uint8_t *raw(std::span<std::byte> bytes) noexcept { return reinterpret_cast<std::uint8_t *>(bytes.data()); }
inline const std::uint8_t *raw(std::span<const std::byte> bytes) noexcept
{
    return reinterpret_cast<const std::uint8_t *>(bytes.data());
}

template <class T>
constexpr Result<T> result(std::int32_t code, const T &value) noexcept
{
    if (code == FINGERPAD_OK) {
        return value;
    }
    return static_cast<Code>(code);
}

} // namespace detail

/* A bed of springs: the model of one pose of the finger on a plane. */
class Bed {
public:
    /* Checks a model file, which stays in use; its address must be divisible by 4. */
    static Result<Bed> load(std::span<const std::byte> file) noexcept
    {
        Bed bed;
        const std::int32_t code = fingerpad_model_load(&bed.model_, detail::raw(file), file.size());
        return detail::result(code, bed);
    }

    /* The same, also for contacts of tissue that relaxes by the branches of its file. */
    static Result<Bed> load_relaxing(std::span<const std::byte> file) noexcept
    {
        Bed bed;
        const std::int32_t code = fingerpad_relaxing_model_load(&bed.model_, detail::raw(file), file.size());
        return detail::result(code, bed);
    }

    /* Another finger: factors on size (0.5 to 2), stiffness (0.2 to 5) and lambda (0.1 to 10). */
    Code tune(float size, float stiffness, float lambda) noexcept
    {
        return static_cast<Code>(fingerpad_model_tune(&model_, size, stiffness, lambda));
    }

    /* Gives the tissue other branches than the file's; none: it does not relax. Contacts must be made again. */
    Code relax(std::span<const Branch> branches) noexcept
    {
        return static_cast<Code>(fingerpad_model_relax(&model_, branches.data(), branches.size()));
    }

    Result<BedInfo> info() const noexcept
    {
        BedInfo info{};
        const std::int32_t code = fingerpad_model_describe(&model_, &info);
        return detail::result(code, info);
    }

    /* The least depth and normal force that hold a load with a slip margin of 0 to 0.95. */
    Result<Grip> least_grip(float load_x_n, float load_y_n, float margin, float strength_factor) const noexcept
    {
        Grip grip{};
        const std::int32_t code = fingerpad_least_grip(&model_, load_x_n, load_y_n, margin, strength_factor, &grip);
        return detail::result(code, grip);
    }

    fingerpad_model &c() noexcept { return model_; }
    const fingerpad_model &c() const noexcept { return model_; }

private:
    fingerpad_model model_{};
};

/* The response of a driven step and the motion that led to it. */
struct Driven {
    Response response;
    Motion motion;
};

namespace detail {

/* The functions of fingerpad.h for one kind of contact of a bed; their names begin alike. */
#define FINGERPAD_KIND(Name, begins, BEGINS, ...)                                           \
    struct Name {                                                                           \
        using State = begins##state;                                                        \
        static constexpr std::size_t saved_bytes = BEGINS##STATE_BYTES;                     \
        static constexpr auto init = begins##state_init;                                    \
        static constexpr auto step = begins##step;                                          \
        static constexpr auto step_driven = begins##step_driven;                            \
        static constexpr auto set_strength_factor = begins##state_set_strength_factor;      \
        static constexpr auto gradient = begins##state_gradient;                            \
        static constexpr auto save = begins##state_save;                                    \
        static constexpr auto restore = begins##state_restore;                              \
        __VA_ARGS__                                                                         \
    }

FINGERPAD_KIND(Slides, fingerpad_, FINGERPAD_, static constexpr auto step_batch = fingerpad_step_batch;);
FINGERPAD_KIND(Spins, fingerpad_spin_, FINGERPAD_SPIN_, static constexpr auto step_batch = fingerpad_spin_step_batch;);
FINGERPAD_KIND(RelaxingSlides, fingerpad_relaxing_, FINGERPAD_RELAXING_, );
FINGERPAD_KIND(RelaxingSpins, fingerpad_relaxing_spin_, FINGERPAD_RELAXING_SPIN_, );

#undef FINGERPAD_KIND

} // namespace detail

/* The memory of a contact of a bed; a new one is in the air, with a strength factor of 1. */
template <class Kind>
class ContactOf {
public:
    static constexpr std::size_t saved_bytes = Kind::saved_bytes;

    ContactOf() noexcept { (void)Kind::init(&state_); }

    Result<Response> step(const Bed &bed, const Motion &motion) noexcept
    {
        Response response{};
        const std::int32_t code = Kind::step(&bed.c(), &state_, motion, &response);
        return detail::result(code, response);
    }

    Result<Driven> step_driven(const Bed &bed, const Drive &drive) noexcept
    {
        Driven driven{};
        const std::int32_t code = Kind::step_driven(&bed.c(), &state_, drive, &driven.response, &driven.motion);
        return detail::result(code, driven);
    }

    /* Factor on all strengths, 0.1 to 5, from the next step on. */
    Code set_strength_factor(float factor) noexcept
    {
        return static_cast<Code>(Kind::set_strength_factor(&state_, factor));
    }

    Result<Gradient> gradient(const Bed &bed, float depth_mm, float slide_x_mm, float slide_y_mm) const noexcept
    {
        Gradient gradient{};
        const std::int32_t code = Kind::gradient(&bed.c(), &state_, depth_mm, slide_x_mm, slide_y_mm, &gradient);
        return detail::result(code, gradient);
    }

    /* Writes `saved_bytes` bytes. */
    Code save(const Bed &bed, std::span<std::byte> out) const noexcept
    {
        return static_cast<Code>(Kind::save(&bed.c(), &state_, detail::raw(out), out.size()));
    }

    static Result<ContactOf> restore(const Bed &bed, std::span<const std::byte> saved) noexcept
    {
        ContactOf contact;
        const std::int32_t code = Kind::restore(&bed.c(), &contact.state_, detail::raw(saved), saved.size());
        return detail::result(code, contact);
    }

    /* Steps many contacts; the three counts must agree, else `Code::buffer`, and nothing changes. */
    static Code step_batch(const Bed &bed, std::span<ContactOf> contacts, const Motions &motions,
                           std::span<Response> responses) noexcept
        requires requires { Kind::step_batch; }
    {
        static_assert(sizeof(ContactOf) == sizeof(typename Kind::State));
        if (responses.size() != contacts.size()) {
            return Code::buffer;
        }
        typename Kind::State *const states = contacts.empty() ? nullptr : &contacts.data()->state_;
        return static_cast<Code>(Kind::step_batch(&bed.c(), states, &motions, responses.data(), contacts.size()));
    }

    typename Kind::State &c() noexcept { return state_; }
    const typename Kind::State &c() const noexcept { return state_; }

private:
    typename Kind::State state_{};
};

/* A contact that slides, and one that also spins, at twice the cost; of a bed that does not relax (`Code::not_set_up` for another). */
using Contact = ContactOf<detail::Slides>;
using SpinContact = ContactOf<detail::Spins>;
/* The same of any bed, in more memory and without `step_batch`. */
using RelaxingContact = ContactOf<detail::RelaxingSlides>;
using RelaxingSpinContact = ContactOf<detail::RelaxingSpins>;

/* A pad: the model of every pose of the finger on planes, spheres, cylinders and edges. */
class Pad {
public:
    /* Checks a pad's file, which stays in use; its address must be divisible by 4. */
    static Result<Pad> load(std::span<const std::byte> file) noexcept
    {
        Pad pad;
        const std::int32_t code = fingerpad_pad_load(&pad.pad_, detail::raw(file), file.size());
        return detail::result(code, pad);
    }

    /* The same, also for contacts of tissue that relaxes by the branches of its file. */
    static Result<Pad> load_relaxing(std::span<const std::byte> file) noexcept
    {
        Pad pad;
        const std::int32_t code = fingerpad_relaxing_pad_load(&pad.pad_, detail::raw(file), file.size());
        return detail::result(code, pad);
    }

    /* Another finger: factors on size (0.5 to 2), stiffness (0.2 to 5) and lambda (0.1 to 10). Contacts must be made again. */
    Code tune(float size, float stiffness, float lambda) noexcept
    {
        return static_cast<Code>(fingerpad_pad_tune(&pad_, size, stiffness, lambda));
    }

    /* Gives the tissue other branches than the file's; none: it does not relax. Contacts must be made again. */
    Code relax(std::span<const Branch> branches) noexcept
    {
        return static_cast<Code>(fingerpad_pad_relax(&pad_, branches.data(), branches.size()));
    }

    Result<PadInfo> info() const noexcept
    {
        PadInfo info{};
        const std::int32_t code = fingerpad_pad_describe(&pad_, &info);
        return detail::result(code, info);
    }

    /* The point of the undeformed finger that a plane touches first in a pose, mm along the finger's axes. */
    Result<std::array<float, 3>> first_touch(float pitch_deg, float roll_deg) const noexcept
    {
        std::array<float, 3> place_mm{};
        const std::int32_t code = fingerpad_pad_first_touch(&pad_, pitch_deg, roll_deg, place_mm.data());
        return detail::result(code, place_mm);
    }

    fingerpad_pad &c() noexcept { return pad_; }
    const fingerpad_pad &c() const noexcept { return pad_; }

private:
    fingerpad_pad pad_{};
};

namespace detail {

/* The states and contacts of fingerpad.h of a pad that does not relax, and of any pad. */
struct Prompt {
    using State = fingerpad_pad_state;
    static constexpr std::size_t saved_bytes_max = FINGERPAD_PAD_STATE_BYTES;
    static constexpr auto init = fingerpad_pad_state_init;
    static constexpr auto init_over = fingerpad_pad_state_init_over;
    static constexpr fingerpad_pad_state *state(State *state) noexcept { return state; }
    static constexpr const fingerpad_pad_state *state(const State *state) noexcept { return state; }

    using Frame = fingerpad_frame_contact;
    static constexpr auto frame_init = fingerpad_frame_init_pad;
    static constexpr fingerpad_frame_contact *frame(Frame *contact) noexcept { return contact; }
    static constexpr const fingerpad_frame_contact *frame(const Frame *contact) noexcept { return contact; }
};

struct Relaxes {
    using State = fingerpad_relaxing_pad_state;
    static constexpr std::size_t saved_bytes_max = FINGERPAD_RELAXING_PAD_STATE_BYTES;
    static constexpr auto init = fingerpad_relaxing_pad_state_init;
    static constexpr auto init_over = fingerpad_relaxing_pad_state_init_over;
    static constexpr fingerpad_pad_state *state(State *state) noexcept { return &state->state; }
    static constexpr const fingerpad_pad_state *state(const State *state) noexcept { return &state->state; }

    using Frame = fingerpad_relaxing_frame_contact;
    static constexpr auto frame_init = fingerpad_relaxing_frame_init_pad;
    static constexpr fingerpad_frame_contact *frame(Frame *contact) noexcept { return &contact->contact; }
    static constexpr const fingerpad_frame_contact *frame(const Frame *contact) noexcept { return &contact->contact; }
};

} // namespace detail

/* The memory of a contact of a pad. It belongs to one pad, one tuning and one body. */
template <class Kind>
class PadContactOf {
public:
    static constexpr std::size_t saved_bytes_max = Kind::saved_bytes_max;

    /* A finger in the air over a plane. */
    static Result<PadContactOf> on_plane(const Pad &pad) noexcept
    {
        PadContactOf contact;
        const std::int32_t code = Kind::init(&pad.c(), &contact.state_);
        return detail::result(code, contact);
    }

    /* A finger in the air over a body whose apex lies under first touch in that pose. */
    static Result<PadContactOf> over(const Pad &pad, float pitch_deg, float roll_deg) noexcept
    {
        PadContactOf contact;
        const std::int32_t code = Kind::init_over(&pad.c(), &contact.state_, pitch_deg, roll_deg);
        return detail::result(code, contact);
    }

    Result<Response> step(const Pad &pad, const Body &body, const PadMotion &motion) noexcept
    {
        Response response{};
        const std::int32_t code = fingerpad_pad_step(&pad.c(), Kind::state(&state_), body, motion, &response);
        return detail::result(code, response);
    }

    /* Factor on all strengths, 0.1 to 5, from the next step on. */
    Code set_strength_factor(float factor) noexcept
    {
        return static_cast<Code>(fingerpad_pad_state_set_strength_factor(Kind::state(&state_), factor));
    }

    /* The patches after the last step on that step's body: the part of `out` that was written. */
    Result<std::span<Patch>> patches(const Pad &pad, const Body &body, std::span<Patch> out) const noexcept
    {
        PadInfo info{};
        std::int32_t code = fingerpad_pad_describe(&pad.c(), &info);
        if (code == FINGERPAD_OK) {
            code = fingerpad_pad_patches(&pad.c(), Kind::state(&state_), body, out.data(), out.size());
        }
        return detail::result(code, code == FINGERPAD_OK ? out.first(info.patches) : std::span<Patch>());
    }

    /* Writes `PadInfo::state_bytes` bytes, at most `saved_bytes_max`. */
    Code save(const Pad &pad, std::span<std::byte> out) const noexcept
    {
        return static_cast<Code>(fingerpad_pad_state_save(&pad.c(), Kind::state(&state_), detail::raw(out), out.size()));
    }

    static Result<PadContactOf> restore(const Pad &pad, std::span<const std::byte> saved) noexcept
    {
        PadContactOf contact;
        /* The state of a pad that relaxes must show its room. */
        std::int32_t code = Kind::init(&pad.c(), &contact.state_);
        if (code == FINGERPAD_OK) {
            code = fingerpad_pad_state_restore(&pad.c(), Kind::state(&contact.state_), detail::raw(saved), saved.size());
        }
        return detail::result(code, contact);
    }

    fingerpad_pad_state &c() noexcept { return *Kind::state(&state_); }
    const fingerpad_pad_state &c() const noexcept { return *Kind::state(&state_); }

private:
    typename Kind::State state_{};
};

/* Contacts of a pad that does not relax (`Code::buffer` for another), and of any pad in two and a half times the memory. */
using PadContact = PadContactOf<detail::Prompt>;
using RelaxingPadContact = PadContactOf<detail::Relaxes>;

/* A finger against one body, from the pose of the body in the finger's frame. It belongs to one pad or bed, one tuning and one body. */
template <class Kind>
class FrameContactOf {
public:
    /* A finger in the air that is to touch a body of this shape; `Code::range` for sizes out of range. */
    static Result<FrameContactOf> with(const Pad &pad, const Shape &shape) noexcept
    {
        FrameContactOf contact;
        const std::int32_t code = Kind::frame_init(&pad.c(), shape, &contact.contact_);
        return detail::result(code, contact);
    }

    /* The same of a bed, which touches planes and boxes: `Code::range` for other shapes. */
    static Result<FrameContactOf> with(const Bed &bed, const Shape &shape) noexcept
    {
        FrameContactOf contact;
        const std::int32_t code = fingerpad_frame_init_bed(&bed.c(), shape, &contact.c());
        return detail::result(code, contact);
    }

    /* One step of `dt_s` seconds; the pose is that at its end, and a pose that is none is flagged. */
    Result<FrameResponse> step(const Pad &pad, const Pose &body, float dt_s) noexcept
    {
        FrameResponse response{};
        const std::int32_t code = fingerpad_frame_step_pad(&pad.c(), &c(), &body, dt_s, &response);
        return detail::result(code, response);
    }

    Result<FrameResponse> step(const Bed &bed, const Pose &body, float dt_s) noexcept
    {
        FrameResponse response{};
        const std::int32_t code = fingerpad_frame_step_bed(&bed.c(), &c(), &body, dt_s, &response);
        return detail::result(code, response);
    }

    /* The patches of a pad after the last step, a tactile skin in the finger's frame: the part of `out` that was written. */
    Result<std::span<FramePatch>> patches(const Pad &pad, std::span<FramePatch> out) const noexcept
    {
        PadInfo info{};
        std::int32_t code = fingerpad_pad_describe(&pad.c(), &info);
        if (code == FINGERPAD_OK) {
            code = fingerpad_frame_patches(&pad.c(), &c(), out.data(), out.size());
        }
        return detail::result(code, code == FINGERPAD_OK ? out.first(info.patches) : std::span<FramePatch>());
    }

    /* Factor on all strengths, 0.1 to 5, from the next step on. */
    Code set_strength_factor(float factor) noexcept
    {
        return static_cast<Code>(fingerpad_frame_set_strength_factor(&c(), factor));
    }

    fingerpad_frame_contact &c() noexcept { return *Kind::frame(&contact_); }
    const fingerpad_frame_contact &c() const noexcept { return *Kind::frame(&contact_); }

private:
    typename Kind::Frame contact_{};
};

/* Contacts of a bed, or of a pad that does not relax (`Code::buffer` for another). The second serves any bed and any pad. */
using FrameContact = FrameContactOf<detail::Prompt>;
using RelaxingFrameContact = FrameContactOf<detail::Relaxes>;

/* Detects touch, first slip, full slip, restick and lift-off in the responses of one finger. */
class Watch {
public:
    static WatchSettings settings() noexcept
    {
        WatchSettings settings{};
        (void)fingerpad_watch_settings_default(&settings);
        return settings;
    }

    static Result<Watch> make(std::uint8_t finger, const WatchSettings &settings) noexcept
    {
        Watch watch;
        const std::int32_t code = fingerpad_watch_init(&watch.watch_, finger, settings);
        return detail::result(code, watch);
    }

    /* The events of one response: the part of `out` that was written. */
    Result<std::span<Event>> look(const Response &response, std::span<Event, FINGERPAD_EVENTS_A_LOOK> out) noexcept
    {
        std::uint32_t count = 0;
        const std::int32_t code = fingerpad_watch_look(&watch_, &response, out.data(), &count);
        return detail::result(code, std::span<Event>(out).first(code == FINGERPAD_OK ? count : 0));
    }

    fingerpad_watch &c() noexcept { return watch_; }

private:
    fingerpad_watch watch_{};
};

/* The description in a model file, JSON; it lies in the file. */
inline std::string_view meta(const BedInfo &info) noexcept { return {info.meta, info.meta_length}; }
inline std::string_view meta(const PadInfo &info) noexcept { return {info.meta, info.meta_length}; }

} // namespace fingerpad

#endif
