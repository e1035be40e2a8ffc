/* Part of camlux.hpp: renderers and jobs. */

#ifndef CAMLUX_RENDERER_HPP
#define CAMLUX_RENDERER_HPP

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "device.hpp"
#include "frame.hpp"
#include "scene.hpp"
#include "values.hpp"

namespace camlux {

/** camlux_cancel_token: cancels renders from another thread. Copies refer to the same token. */
class cancel_token
    : public detail::handle<camlux_cancel_token, camlux_cancel_token_retain, camlux_cancel_token_release> {
public:
    using handle::handle;

    static cancel_token create() { return try_create().value(); }
    static result<cancel_token> try_create()
    {
        camlux_cancel_token *created = nullptr;
        const camlux_status status = camlux_cancel_token_create(&created);
        return detail::ended(status, cancel_token(created));
    }

    /** Cancels all renders with this token, running and future ones. */
    void cancel() { try_cancel().value(); }
    result<void> try_cancel() { return detail::ended(camlux_cancel_token_cancel(get())); }
};

/** camlux_target: a layer, and the memory for it. The memory must be valid until the render has ended. */
struct target : camlux_target {
    /** \param stride_bytes 0: rows are contiguous. */
    target(camlux::layer which, void *to, std::size_t bytes, std::size_t stride_bytes = 0) noexcept
        : camlux_target(CAMLUX_TARGET_INIT)
    {
        layer = static_cast<std::int32_t>(which);
        data = to;
        size_bytes = bytes;
        row_stride_bytes = stride_bytes;
    }
};

/** camlux_render_options. */
struct render_options {
    std::uint32_t submission_target_ms = 500;
    /** Receives the completed fraction and the name of the next pass; returning false cancels the render. */
    std::function<bool(double fraction, std::string_view pass)> progress = {};
    /** The images stay on the device: see frame::vulkan_image. */
    bool on_device = false;
    /** Index of the frame in a sequence. Each frame has its own noise. Empty: the renderer counts; frame_stats tells the index. */
    std::optional<std::uint32_t> frame_index = std::nullopt;
    /** Another seed gives other samples of indirect light, and other noise. */
    std::uint32_t seed = 0;
    /** An empty token: none. */
    camlux::cancel_token cancel_token = {};
    /** Where layers go; empty: they stay with the frame. */
    std::vector<target> targets = {};
    /** A render that is cancelled once it runs returns the best image that it has, with its estimated error. */
    bool keep_partial = false;
    /** Layers of the frame; empty: all of the scene, except those that are there on request only. Not with on_device or targets. */
    std::vector<layer> layers = {};
};

namespace detail {

using progress_function = std::function<bool(double, std::string_view)>;

/** Reports progress to the host. Returns what a progress callback returns. */
inline std::int32_t report_to(const progress_function &progress, kept_exception &thrown, double fraction, const char *pass) noexcept
{
    bool goes_on = false;
    const bool returned = guarded(thrown, [&] { goes_on = progress(fraction, pass); });
    return returned && goes_on ? 0 : 1;
}

/** The progress callback for camlux_renderer_render. */
inline std::int32_t report(double fraction, const char *pass, void *user)
{
    return report_to(*static_cast<const progress_function *>(user), thrown(), fraction, pass);
}

/** The result is valid as long as `options` exists. */
inline camlux_render_options raw_of(const render_options &options) noexcept
{
    camlux_render_options raw = CAMLUX_RENDER_OPTIONS_INIT;
    raw.submission_target_ms = options.submission_target_ms;
    raw.on_device = options.on_device ? 1 : 0;
    raw.frame_index = options.frame_index.value_or(CAMLUX_NEXT_FRAME);
    raw.seed = options.seed;
    raw.cancel_token = options.cancel_token.get();
    raw.targets = options.targets.data();
    raw.target_count = options.targets.size();
    raw.keep_partial = options.keep_partial ? 1 : 0;
    static_assert(sizeof(layer) == sizeof(std::int32_t), "layers are passed as numbers");
    raw.layers = reinterpret_cast<const std::int32_t *>(options.layers.data());
    raw.layer_count = options.layers.size();
    if (options.progress) {
        raw.progress = report;
        raw.progress_user = const_cast<progress_function *>(&options.progress);
    }
    return raw;
}

/** What a job's callbacks need. Also its thread holds it, because a callback may release the last copy of its own job. */
struct job_state : std::enable_shared_from_this<job_state> {
    explicit job_state(render_options from) : options(std::move(from)) {}

    render_options options;
    kept_exception thrown = {};
};

/** The progress callback for camlux_renderer_submit. A job always has it: it tells the job's thread where exceptions go. */
inline std::int32_t report_of_job(double fraction, const char *pass, void *user)
{
    auto &state = *static_cast<job_state *>(user);
    thrown_by_job() = std::shared_ptr<kept_exception>(state.shared_from_this(), &state.thrown);
    return state.options.progress ? report_to(state.options.progress, state.thrown, fraction, pass) : 0;
}

}  // namespace detail

/** camlux_job: a render that runs while the host does something else. The destructor of the last copy cancels it, and waits until it has ended. */
class job {
public:
    job() noexcept = default;

    explicit operator bool() const noexcept { return static_cast<bool>(handle_); }
    camlux_job *get() const noexcept { return handle_.get(); }

    bool is_done() const { return try_is_done().value(); }
    result<bool> try_is_done() const
    {
        std::int32_t done = 0;
        const camlux_status status = camlux_job_poll(get(), &done);
        return detail::ended(status, done != 0);
    }

    /** Waits until the job is done, at most for a time. Returns whether it is done: wait() then does not wait. */
    template <class Number, class Period>
    bool wait_for(std::chrono::duration<Number, Period> longest) const
    {
        return try_wait_for(longest).value();
    }
    template <class Number, class Period>
    result<bool> try_wait_for(std::chrono::duration<Number, Period> longest) const
    {
        const std::chrono::duration<double, std::milli> milliseconds = longest;
        std::int32_t done = 0;
        const camlux_status status = camlux_job_wait_for(get(), milliseconds.count(), &done);
        return detail::ended(status, done != 0);
    }

    /** Waits for the job and returns its frame, once. Throws the exception of its progress function, at every call. */
    frame wait() { return try_wait().value(); }
    result<frame> try_wait()
    {
        camlux_frame *rendered = nullptr;
        const camlux_status status = camlux_job_wait(get(), &rendered);
        frame made(rendered);
#if CAMLUX_HPP_EXCEPTIONS
        // On the job's own thread nothing has ended.
        if (state_ && status == CAMLUX_OK)
            detail::thrown().keep(state_->thrown.take());
        else if (const std::exception_ptr exception = state_ && status != CAMLUX_ERROR_BUSY ? state_->thrown.get() : nullptr)
            std::rethrow_exception(exception);
#endif
        return detail::ended(status, std::move(made));
    }

private:
    friend class renderer;
    using handle = detail::handle<camlux_job, camlux_job_retain, camlux_job_release>;

    // Declared before the handle, so that it outlives the render.
    std::shared_ptr<detail::job_state> state_ = nullptr;
    handle handle_ = {};
};

/** camlux_renderer: renders frames on a device, one at a time. Make one for each thread. */
class renderer : public detail::handle<camlux_renderer, camlux_renderer_retain, camlux_renderer_release> {
public:
    using handle::handle;

    static renderer create(const device &device) { return try_create(device).value(); }
    static result<renderer> try_create(const device &device)
    {
        camlux_renderer *created = nullptr;
        const camlux_status status = camlux_renderer_create(device.get(), &created);
        return detail::ended(status, renderer(created));
    }

    frame render(const scene &scene, const render_options &options = {}) { return try_render(scene, options).value(); }
    result<frame> try_render(const scene &scene, const render_options &options = {})
    {
        const camlux_render_options raw = detail::raw_of(options);
        camlux_frame *rendered = nullptr;
        const camlux_status status = camlux_renderer_render(get(), scene.get(), &raw, &rendered);
        return detail::ended(status, frame(rendered));
    }

    /** Renders the scene from several cameras: see camlux_renderer_render_cameras. */
    std::vector<frame> render(const scene &scene, const std::vector<camera> &cameras, const render_options &options = {})
    {
        return try_render(scene, cameras, options).value();
    }
    result<std::vector<frame>> try_render(const scene &scene, const std::vector<camera> &cameras, const render_options &options = {})
    {
        std::vector<camlux_camera> raw_cameras;
        raw_cameras.reserve(cameras.size());
        for (const camera &one : cameras)
            raw_cameras.push_back(detail::raw_of(one));
        const camlux_render_options raw = detail::raw_of(options);
        std::vector<camlux_frame *> rendered(cameras.size());
        const camlux_status status = camlux_renderer_render_cameras(
            get(), scene.get(), raw_cameras.data(), raw_cameras.size(), sizeof(camlux_camera), &raw, rendered.data());
        std::vector<frame> frames;
        frames.reserve(rendered.size());
        for (camlux_frame *one : rendered)
            frames.push_back(frame(one));
        return detail::ended(status, std::move(frames));
    }

    /** Starts to render on its own thread. The progress function is called there, too. */
    job submit(const scene &scene, render_options options = {}) { return try_submit(scene, std::move(options)).value(); }
    result<job> try_submit(const scene &scene, render_options options = {})
    {
        job submitted;
        submitted.state_ = std::make_shared<detail::job_state>(std::move(options));
        camlux_render_options raw = detail::raw_of(submitted.state_->options);
        raw.progress = detail::report_of_job;
        raw.progress_user = submitted.state_.get();
        camlux_job *begun = nullptr;
        const camlux_status status = camlux_renderer_submit(get(), scene.get(), &raw, &begun);
        submitted.handle_ = job::handle(begun);
        return detail::ended(status, std::move(submitted));
    }

    /** Compiles and copies to the device what frames of the scene need: see camlux_renderer_prepare. Returns the milliseconds that it took. */
    double prepare(const scene &scene) { return try_prepare(scene).value(); }
    result<double> try_prepare(const scene &scene)
    {
        double milliseconds = 0.0;
        const camlux_status status = camlux_renderer_prepare(get(), scene.get(), &milliseconds);
        return detail::ended(status, milliseconds);
    }

    /** Predicts the GPU time of a frame: see camlux_renderer_foretell_ms. */
    double foretell_ms(const scene &scene) const { return try_foretell_ms(scene).value(); }
    result<double> try_foretell_ms(const scene &scene) const
    {
        double milliseconds = 0.0;
        const camlux_status status = camlux_renderer_foretell_ms(get(), scene.get(), &milliseconds);
        return detail::ended(status, milliseconds);
    }
};

}  // namespace camlux

#endif  /* CAMLUX_RENDERER_HPP */
