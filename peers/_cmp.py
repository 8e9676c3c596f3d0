import numpy as np, image_files as f
np.set_printoptions(linewidth=200,precision=3,suppress=True)
R='/work/wt-traced/tests/references/'
imgs=np.array([f.read('/tmp/wip-traced/agl_%d.exr'%s)[...,:3].sum(-1) for s in (5,6,7,8)])
ex=f.read(R+'art_gallery_b2_indirect.exr').sum(-1); mm=imgs.mean(0)
sl=np.s_[80:88,48:56]
print(mm[sl]-ex[sl]); print(ex[sl]); print(imgs.std(0)[sl]/2)
n=f.read(R+'art_gallery_normal.exr'); print((n[sl]**2).sum(-1)); print(f.read(R+'art_gallery_depth.exr')[sl][...,0])
a=f.read(R+'art_gallery_full.exr').sum(-1)-f.read(R+'art_gallery_direct.exr').sum(-1)
print(np.argwhere((n**2).sum(-1)<.5))
