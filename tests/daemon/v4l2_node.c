// Plays one V4L2 node to a program, by LD_PRELOAD: left_out_test.py, stay_test.py.
// LD_PRELOAD: plays a V4L2 node at the path $FAKE_NODE (an ordinary file). Controls in $FAKE_CTL, one a line:
//   ID(hex) TYPE(1 int,2 bool,3 menu) MIN MAX STEP DEFAULT VALUE FLAGS(hex) [KIND ARG]
// KIND: ok | err N (setting answers errno N) | errn N K (the first K settings) | quant Q (rounds to Q) | clamp HI | ignore | inactive ID2 (EACCES while ID2 is 1) | lag MS | geterr N
// $FAKE_SHARED=1: several programs play one node. What one sets is in $FAKE_CTL for the others, who get events of it.
// $FAKE_FMT: W H FOURCC FPS BYTESPERLINE SIZEIMAGE BYTESUSED CAP(hex) FLAGS(hex)
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <pthread.h>
struct ctl { unsigned id, type, flags; long long min,max,step,def,val,old; char kind[16]; long long arg, arg2; struct timespec at; };
static struct ctl C[64]; static int n; static time_t loaded; static pthread_mutex_t M=PTHREAD_MUTEX_INITIALIZER;
static unsigned W=320,H=240,FOURCC,BPL,SIZE,USED,CAP=V4L2_CAP_VIDEO_CAPTURE|V4L2_CAP_STREAMING|V4L2_CAP_EXT_PIX_FORMAT,BF; static double FPS=30;
static unsigned nbuf, seq, qd[32], nq; static struct timespec next; static int streaming;
static double now(void){ struct timespec t; clock_gettime(CLOCK_MONOTONIC,&t); return t.tv_sec+t.tv_nsec*1e-9; }
static double nextt;
static unsigned subs[16]; static long long told[16]; static int ns;
static int shared(void){ return getenv("FAKE_SHARED")!=0; }
static int lock_node(void){ if(!shared()) return -1; int fd=open(getenv("FAKE_NODE"),O_RDONLY); if(fd>=0) flock(fd,LOCK_EX); return fd; }
static void save(unsigned id){ if(!shared()) return; const char*p=getenv("FAKE_CTL"); char t[600]; snprintf(t,600,"%s.%d",p,(int)getpid()); FILE*f=fopen(t,"w"); if(!f) return;
  for(int i=0;i<n;i++) fprintf(f,"%08x %u %lld %lld %lld %lld %lld %x %s %lld %lld\n",C[i].id,C[i].type,C[i].min,C[i].max,C[i].step,C[i].def,C[i].val,C[i].flags,C[i].kind,C[i].arg,C[i].arg2); fclose(f); rename(t,p);
  for(int i=0;i<ns;i++) if(subs[i]==id) for(int k=0;k<n;k++) if(C[k].id==id) told[i]=C[k].val; }
static void load(void){ const char*p=getenv("FAKE_CTL"); struct stat s; if(!p||stat(p,&s)) return; static struct timespec lm; if(!shared()&&s.st_mtim.tv_sec==lm.tv_sec&&s.st_mtim.tv_nsec==lm.tv_nsec) return; int first=!lm.tv_sec; lm=s.st_mtim; FILE*f=fopen(p,"r"); char l[256]; struct ctl N[64]; int m=0;
  while(f&&fgets(l,256,f)){ struct ctl c={0}; if(*l=='#') continue; strcpy(c.kind,"ok"); int k=sscanf(l,"%x %u %lld %lld %lld %lld %lld %x %15s %lld %lld",&c.id,&c.type,&c.min,&c.max,&c.step,&c.def,&c.val,&c.flags,c.kind,&c.arg,&c.arg2); if(k<8) continue; N[m++]=c; } if(f)fclose(f);
  (void)first; memcpy(C,N,sizeof N); n=m; 
  const char*q=getenv("FAKE_FMT"); char cc[8]="GREY"; if(q) sscanf(q,"%u %u %7s %lf %u %u %u %x %x",&W,&H,cc,&FPS,&BPL,&SIZE,&USED,&CAP,&BF); FOURCC=v4l2_fourcc(cc[0],cc[1],cc[2],cc[3]); int bpp=!strcmp(cc,"YUYV")||!strcmp(cc,"Y16 ")?2:1; if(!BPL)BPL=W*bpp; if(!SIZE)SIZE=BPL*H; if(!USED)USED=SIZE; }
static struct ctl*find(unsigned id){ for(int i=0;i<n;i++) if(C[i].id==id) return C+i; return 0; }
static int mine(int fd){ const char*p=getenv("FAKE_NODE"); if(!p) return 0; char a[64],b[512]; snprintf(a,64,"/proc/self/fd/%d",fd); ssize_t k=readlink(a,b,511); if(k<0) return 0; b[k]=0; return !strcmp(b,p); }
static void say(const char*f,...){ const char*p=getenv("FAKE_LOG"); if(!p) return; FILE*o=fopen(p,"a"); va_list v; va_start(v,f); vfprintf(o,f,v); va_end(v); fclose(o); }
static int setc(struct v4l2_ext_control*e){ struct ctl*c=find(e->id); if(!c) return EINVAL; say("set %x %d\n",e->id,e->value);
  if(!strcmp(c->kind,"err")) return (int)c->arg; if(!strcmp(c->kind,"errn")&&c->arg2>0){ c->arg2--; return (int)c->arg; } if(!strcmp(c->kind,"ignore")) return 0;
  if(!strcmp(c->kind,"inactive")){ struct ctl*o=find((unsigned)c->arg); if(o&&o->val) return EACCES; }
  long long v=e->value; if(v<c->min)v=c->min; if(v>c->max)v=c->max; if(c->step>1&&c->type==1){ v=c->min+(v-c->min+c->step/2)/c->step*c->step; if(v>c->max) v-=c->step; }
  if(!strcmp(c->kind,"quant")) v=(v+c->arg/2)/c->arg*c->arg; if(!strcmp(c->kind,"clamp")&&v>c->arg) v=c->arg; if(!strcmp(c->kind,"lag")){ c->old=c->val; clock_gettime(CLOCK_MONOTONIC,&c->at); }
  c->val=v; e->value=(int)v; save(c->id); return 0; }
static int getc_(struct v4l2_ext_control*e){ struct ctl*c=find(e->id); if(!c) return EINVAL; if(!strcmp(c->kind,"geterr")) return (int)c->arg; if(!strcmp(c->kind,"lag")&&now()-(c->at.tv_sec+c->at.tv_nsec*1e-9)<c->arg/1000.) e->value=(int)c->old; else e->value=(int)c->val; return 0; }
static int fmt(struct v4l2_format*f){ f->fmt.pix.width=W; f->fmt.pix.height=H; f->fmt.pix.pixelformat=FOURCC; f->fmt.pix.bytesperline=BPL; f->fmt.pix.sizeimage=SIZE; f->fmt.pix.field=V4L2_FIELD_NONE; f->fmt.pix.colorspace=V4L2_COLORSPACE_SRGB; return 0; }
static void fill(unsigned i){ const char*p=getenv("FAKE_NODE"); if(getenv("FAKE_JPEG")){ FILE*f=fopen(getenv("FAKE_JPEG"),"r"); static unsigned char b[4000000]; size_t k=f?fread(b,1,sizeof b,f):0; if(f)fclose(f); if(k>SIZE)k=SIZE; USED=k; int fd=open(p,O_RDWR); if(fd>=0){ pwrite(fd,b,k,(off_t)i*((SIZE+4095)/4096*4096)); close(fd);} return; } static unsigned char*m; static size_t ms; size_t len=(SIZE+4095)/4096*4096; if(ms<len){ free(m); m=malloc(len); ms=len; } const char*best=getenv("FAKE_BEST"); struct ctl*c=find(0x9a090a); double d=c?(double)(c->val-(best?atoi(best):100))/8:0; int r=(int)(d<0?-d:d); if(r>20)r=20; int bpp=BPL/W; if(bpp<1)bpp=1; static float tx[4096],bx[4096]; static int init; if(!init){ unsigned s=5; float v=0; int k=0; for(int q=0;q<4096;q++){ if(!k--){ s=s*1664525u+1013904223u; v=((s>>8)&0xff)/255.f; k=1+((s>>20)&3);} tx[q]=v; } init=1; } for(unsigned x=0;x<W&&x<4096;x++){ float a=0; int m2=0; for(int k=-r;k<=r;k++){ int j=(int)x+k; if(j<0||j>=4096) continue; a+=tx[j]; m2++; } bx[x]=a/m2; } for(unsigned y=0;y<H;y++) for(unsigned x=0;x<W;x++){ unsigned char v=20+200*bx[(x+y/3)%4096<W?(x+y/3)%W:x]; unsigned char*o=m+y*BPL+x*bpp; if(o-m+bpp>(long)len) break; o[0]=v; if(bpp>1)o[1]=128; }
  int fd=open(p,O_RDWR); if(fd>=0){ pwrite(fd,m,SIZE,(off_t)i*len); close(fd);} }
static int play(unsigned long r,void*a){ load(); struct ctl*c; switch(r){
 case VIDIOC_QUERYCAP:{ struct v4l2_capability*q=a; memset(q,0,sizeof*q); strcpy((char*)q->driver,getenv("FAKE_DRIVER")?getenv("FAKE_DRIVER"):"uvcvideo"); snprintf((char*)q->card,32,"%s",getenv("FAKE_CARD")?getenv("FAKE_CARD"):"Fake cam"); q->capabilities=CAP|V4L2_CAP_DEVICE_CAPS; q->device_caps=CAP; return 0; }
 case VIDIOC_QUERY_EXT_CTRL:{ struct v4l2_query_ext_ctrl*q=a; if(!(c=find(q->id))) return EINVAL; unsigned id=q->id; memset(q,0,sizeof*q); q->id=id; q->type=c->type; q->minimum=c->min; q->maximum=c->max; q->step=c->step; q->default_value=c->def; q->flags=c->flags; snprintf(q->name,32,"control %x",id); return 0; }
 case VIDIOC_S_EXT_CTRLS:{ struct v4l2_ext_controls*e=a; return setc(e->controls); }
 case VIDIOC_G_EXT_CTRLS:{ struct v4l2_ext_controls*e=a; return getc_(e->controls); }
 case VIDIOC_SUBSCRIBE_EVENT:{ struct v4l2_event_subscription*q=a; if(!shared()||!(c=find(q->id))) return 0; int i=0; while(i<ns&&subs[i]!=q->id) i++; if(i==16) return ENOMEM; if(i==ns) ns++; subs[i]=q->id; told[i]=c->val; return 0; }
 case VIDIOC_DQEVENT:{ struct v4l2_event*q=a; for(int i=0;i<ns;i++){ c=find(subs[i]); if(!c||c->val==told[i]) continue; memset(q,0,sizeof*q); q->type=V4L2_EVENT_CTRL; q->id=c->id; q->u.ctrl.changes=V4L2_EVENT_CTRL_CH_VALUE; q->u.ctrl.value=(int)(told[i]=c->val); return 0; } return ENOENT; }
 case VIDIOC_G_FMT: case VIDIOC_S_FMT: case VIDIOC_TRY_FMT: return fmt(a);
 case VIDIOC_ENUM_FMT:{ struct v4l2_fmtdesc*d=a; if(d->index) return EINVAL; d->pixelformat=FOURCC; return 0; }
 case VIDIOC_G_PARM: case VIDIOC_S_PARM:{ struct v4l2_streamparm*p=a; p->parm.capture.timeperframe.numerator=1000; p->parm.capture.timeperframe.denominator=(unsigned)(FPS*1000); return 0; }
 case VIDIOC_REQBUFS:{ struct v4l2_requestbuffers*q=a; nbuf=q->count; nq=0; size_t len=(SIZE+4095)/4096*4096; if(nbuf) truncate(getenv("FAKE_NODE"),len*nbuf); return 0; }
 case VIDIOC_QUERYBUF:{ struct v4l2_buffer*b=a; size_t len=(SIZE+4095)/4096*4096; b->length=SIZE; b->m.offset=b->index*len; return 0; }
 case VIDIOC_QBUF:{ struct v4l2_buffer*b=a; qd[nq++]=b->index; return 0; }
 case VIDIOC_STREAMON: streaming=1; nextt=now()+1/FPS; seq=0; return 0; case VIDIOC_STREAMOFF: streaming=0; nq=0; return 0;
 case VIDIOC_DQBUF:{ struct v4l2_buffer*b=a; double t=now(); if(!streaming||t<nextt) return EAGAIN; while(nextt<t){ nextt+=1/FPS; seq++; } if(!nq) return EAGAIN; unsigned i=qd[0]; memmove(qd,qd+1,sizeof(unsigned)*--nq); fill(i); b->index=i; b->bytesused=USED; b->length=SIZE; b->sequence=seq; b->flags=V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC|V4L2_BUF_FLAG_TSTAMP_SRC_SOE|BF; const char*off=getenv("FAKE_TOFF"); double s=t+(off?atof(off):-0.005); b->timestamp.tv_sec=(long)s; b->timestamp.tv_usec=(long)((s-(long)s)*1e6); return 0; }
 } return ENOTTY; }
int ioctl(int fd,unsigned long r,...){ va_list v; va_start(v,r); void*a=va_arg(v,void*); va_end(v); static int(*real)(int,unsigned long,...); if(!real) real=dlsym(RTLD_NEXT,"ioctl"); if((((r>>8)&0xff)!='V')||!mine(fd)) return real(fd,r,a); pthread_mutex_lock(&M); int l=lock_node(); int e=play(r,a); if(l>=0) close(l); pthread_mutex_unlock(&M); if(e){ errno=e; return -1; } return 0; }
